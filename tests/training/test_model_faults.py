"""Whatever happens to the files of a folder, its active model stays whole and active."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
from nearby_models import nearby

from sdm_core.errors import DamagedFile, InvalidInput
from training import activation
from training.activation import FIRST, FOUND, PROMOTED, activate, active_id, history
from training.promotion import promote, rollback
from training.promotion_check import Remeasured
from training.registry import list_models, load_model


def unmeasured(candidate, active):
    """In place of fresh points: nothing to say."""
    return Remeasured((), {})


@pytest.fixture
def folder(tmp_path):
    """An active model, and another beside it."""
    nearby(tmp_path)
    return tmp_path


@pytest.fixture
def other(folder):
    return nearby(folder, 1.0001)


def cut(file):
    file.write_bytes(file.read_bytes()[:-100])


HURT = {
    "weights cut short": lambda model, active: cut(model / "model.safetensors"),
    "a card cut short": lambda model, active: cut(model / "card.json"),
    "the card of another model": lambda model, active: (model / "card.json").write_bytes(
        (active / "card.json").read_bytes()
    ),
    "the weights of another model": lambda model, active: (model / "model.safetensors").write_bytes(
        (active / "model.safetensors").read_bytes()
    ),
    "no weights": lambda model, active: (model / "model.safetensors").unlink(),
}


@pytest.mark.parametrize("how", HURT)
@pytest.mark.parametrize("force", [False, True])
def test_a_damaged_model_is_promoted_by_nobody(folder, other, how, force):
    active = active_id(folder)
    HURT[how](folder / other.id, folder / active)
    with pytest.raises(DamagedFile, match=other.id):
        promote(other.id, folder, force=force, check=unmeasured)
    assert load_model(folder=folder).id == active and len(history(folder)) == 1


def test_a_model_that_is_gone_is_not_rolled_back_to(folder, other):
    first = active_id(folder)
    promote(other.id, folder, check=unmeasured)
    (folder / first).rename(folder / "elsewhere")
    with pytest.raises(InvalidInput, match="name one of"):
        rollback(folder)
    assert active_id(folder) == other.id


def test_a_damaged_active_model_can_be_rolled_back_and_replaced(folder, other):
    first = active_id(folder)
    promote(other.id, folder, check=unmeasured)
    cut(folder / other.id / "model.safetensors")
    assert rollback(folder).model == first
    cut(folder / first / "card.json")
    third = nearby(folder, 1.0002)
    promote(third.id, folder, check=unmeasured)
    assert load_model(folder=folder).id == third.id


def test_writing_a_damaged_model_again_mends_it(folder, other):
    for name in ("model.safetensors", "card.json"):
        cut(folder / other.id / name)
        assert any(entry.damage for entry in list_models(folder))
        assert nearby(folder, 1.0001).id == other.id
        assert load_model(other.id, folder).certificates == other.certificates


KILLED = """
import os, signal, sys
from pathlib import Path
from training import activation
from training.activation import PROMOTED, activate, active_id

def die(*arguments, **options):
    os.kill(os.getpid(), signal.SIGKILL)

folder = Path(sys.argv[1])
if sys.argv[3] == "before the pointer":
    activation.staged = die
else:
    kept = os.replace
    os.replace = die
activate(sys.argv[2], folder, PROMOTED, expected=active_id(folder))
"""


@pytest.mark.parametrize("when", ["before the pointer", "before the pointer is in place"])
def test_a_promotion_killed_halfway_leaves_the_old_model_active_and_the_folder_usable(folder, other, when):
    first = active_id(folder)
    done = subprocess.run([sys.executable, "-c", KILLED, str(folder), other.id, when], check=False)
    assert done.returncode == -9
    assert load_model(folder=folder).id == first
    assert [(e.event, e.model) for e in history(folder)] == [
        (FIRST, first),
        (PROMOTED, other.id),
        (FOUND, first),
    ]
    with pytest.raises(InvalidInput, match="none was active before"):
        rollback(folder)
    promote(other.id, folder, check=unmeasured)
    assert active_id(folder) == other.id and rollback(folder).model == first


def test_a_line_of_the_history_cut_short_by_a_kill_is_left_out(folder, other):
    file = folder / "history.jsonl"
    with file.open("ab") as history_file:
        history_file.write(b'{"at": "2026-11-22T13:0')
    assert [e.event for e in history(folder)] == [FIRST]
    promote(other.id, folder, check=unmeasured)
    assert [e.event for e in history(folder)] == [FIRST, PROMOTED]
    assert rollback(folder).was == other.id


def full(*arguments, **options):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def contents(folder):
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_a_full_disk_leaves_no_part_of_a_model(folder, monkeypatch):
    before = contents(folder)
    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InvalidInput, match="No space left"):
        nearby(folder, 1.0001)
    monkeypatch.undo()
    assert contents(folder) == before and not list(folder.glob(".*.*"))


def test_a_full_disk_stops_a_promotion_before_anything_is_recorded(folder, other, monkeypatch):
    before = contents(folder)
    monkeypatch.setattr(activation.os, "fsync", full)
    with pytest.raises(InvalidInput, match="No space left"):
        promote(other.id, folder, check=unmeasured)
    monkeypatch.undo()
    assert contents(folder) == before


def test_a_full_disk_under_the_pointer_leaves_the_old_model_active(folder, other, monkeypatch):
    first = active_id(folder)
    sync, calls = os.fsync, []

    def full_the_second_time(file):
        calls.append(file)
        return full() if len(calls) == 2 else sync(file)

    monkeypatch.setattr(activation.os, "fsync", full_the_second_time)
    with pytest.raises(InvalidInput, match="No space left"):
        promote(other.id, folder, check=unmeasured)
    monkeypatch.undo()
    assert load_model(folder=folder).id == first == history(folder)[-1].model
    promote(other.id, folder, check=unmeasured)
    assert rollback(folder).model == first


def test_of_two_promotions_decided_on_the_same_grounds_the_later_is_refused(folder, other):
    first, third = active_id(folder), nearby(folder, 1.0002)

    def meanwhile(candidate, active):
        activate(other.id, folder, PROMOTED, expected=first)
        return Remeasured((), {})

    with pytest.raises(InvalidInput, match=f"{other.id} is active by now"):
        promote(third.id, folder, check=meanwhile)
    assert active_id(folder) == other.id
