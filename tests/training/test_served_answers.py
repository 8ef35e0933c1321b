"""Exact answers given while serving become material for retraining, and cost serving nothing."""

import errno
import logging
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from sdm_core.blade import Blade, ModalState, example_blade
from sdm_core.boundary import boundary
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from sdm_core.fourier_engagement import FourierEngagement
from training import served_answers, served_chunks
from training.answers import EXACT
from training.design_space import DesignSpace
from training.exact_answers import CROSSING, NO_CROSSING, STABLE, UNSTABLE, ExactAnswers
from training.labelling import critical_kappa
from training.pipeline import TrainingSettings, asked
from training.screening import Screener
from training.served_answers import ServedAnswers
from training.served_cases import ServedCases

LE = ContactConfiguration.at("LE")
TWO_ARCS = ContactConfiguration({"LE": 1.0}, [[0.0, 0.25], [0.5, 0.75]])
ROTOR = example_blade("nasa_rotor_37")
SPEEDS = np.linspace(60.0, 300.0, 25)


@pytest.fixture
def kept(tmp_path):
    made = ServedAnswers(tmp_path / "served")
    yield made
    made.close()


@pytest.fixture
def folder(kept, tmp_path):
    return tmp_path / "served"


@pytest.fixture(scope="module")
def model():
    return Screener.default().model


def crossings(speeds, blade=ROTOR, contact=LE, ke=9e3):
    """Answers nobody computed: a crossing at `ke` N/m at each speed."""
    speeds = np.asarray(speeds, dtype=float)
    return ExactAnswers.from_crossings(blade, contact, speeds, np.full(len(speeds), ke), 1e5)


def test_what_the_exact_core_answers_is_kept_and_what_the_surrogate_answers_is_not(model, kept, folder):
    screener = Screener(model, on_exact=kept.keep)
    ke = np.linspace(0.0, 2.5e4, 60)
    found = screener.map(ROTOR, LE, SPEEDS, ke)
    assert 0 < (found.source == EXACT).sum() < found.source.size / 10
    kept.flush()
    cases = ServedAnswers.read(folder)
    verified = SPEEDS[(found.source == EXACT).any(axis=0)]
    assert set(cases.speed_hz) <= set(verified) and len(np.unique(cases.speed_hz)) >= len(verified) - 1
    at = {(s, k): found.stable[i, j] for i, k in enumerate(ke) for j, s in enumerate(SPEEDS)}
    for speed, stiffness, finding in zip(cases.speed_hz, cases.ke, cases.finding, strict=True):
        assert at[speed, stiffness] == (finding == STABLE)
    screener.boundary(ROTOR, LE, SPEEDS[:5], 2e4, "surrogate")
    kept.flush()
    assert len(ServedAnswers.read(folder)) == len(cases)


def test_every_way_of_asking_bounds_the_first_crossing(model, kept, folder):
    screener = Screener(model, on_exact=kept.keep)
    screener.map(ROTOR, LE, SPEEDS, np.linspace(0.0, 2.5e4, 30), "exact")
    screener.points(ROTOR, TWO_ARCS, SPEEDS[::8], np.full(4, 2e3), "exact")
    screener.points(ROTOR, TWO_ARCS, SPEEDS[::8], np.full(4, 6e4), "exact")
    screener.boundary(ROTOR, ContactConfiguration.at("TE"), SPEEDS[::6], 2e4, "exact")
    kept.flush()
    cases, low, high = ServedAnswers.read(folder).bounds()
    assert len(cases) == len(SPEEDS) + 4 + 5 and (low <= high).all()
    assert np.isfinite(low).mean() > 0.9 and np.isfinite(high).mean() > 0.5
    plain = cases.permanent
    truth = np.log10(critical_kappa(cases[plain].cases, workers=1))
    assert (low[plain] <= truth + 1e-9).all() and (truth <= high[plain] + 1e-9).all()
    for i in np.flatnonzero(~plain):
        exact = boundary(ROTOR, TWO_ARCS, cases.speed_hz[i : i + 1], 1e5).critical_ke[0]
        ke = 10.0 ** (np.array([low[i], high[i]])) * cases[i : i + 1].cases.stiffness_scale
        assert ke[0] <= exact <= ke[1] or np.isnan(exact)


def test_crossings_and_their_absence_are_kept_as_such(model, kept, folder):
    Screener(model, on_exact=kept.keep).boundary(ROTOR, LE, SPEEDS, 1e4, "exact")
    kept.flush()
    cases, exact = ServedAnswers.read(folder), boundary(ROTOR, LE, SPEEDS, 1e4).critical_ke
    assert set(cases.finding) == {CROSSING, NO_CROSSING}
    order = np.argsort(cases.speed_hz)
    np.testing.assert_allclose(cases.ke[order], np.where(np.isnan(exact), 1e4, exact), rtol=1e-12)
    np.testing.assert_array_equal(cases.arcs[:, 0], [[0.0, 1.0]] * len(SPEEDS))
    assert np.isnan(cases.arcs[:, 1:]).all()


def test_of_a_column_of_verdicts_the_two_next_to_the_first_crossing_say_it_all():
    ke = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 2.5])
    stable = np.array([1.0, 1.0, 0.0, np.nan, 1.0, 0.0])  # stable again at 5
    said = ExactAnswers.from_verdicts(ROTOR, LE, np.full(6, 100.0), ke, stable).brackets()
    assert list(zip(said.ke, said.finding, strict=True)) == [(2.0, STABLE), (2.5, UNSTABLE)]


def test_a_stable_verdict_above_a_known_instability_bounds_nothing():
    answers = ExactAnswers(
        ROTOR, TWO_ARCS, np.full(3, 200.0), np.array([1e3, 5e3, 9e3]), np.array([STABLE, UNSTABLE, STABLE])
    )
    cases = ServedCases.from_answers(answers)
    (value,), (low,), (high,) = (cases[1:2].log_kappa, *cases.bounds()[1:])
    assert high == value and low == cases.log_kappa[0]
    again = ServedCases.from_answers(replace(answers, finding=np.array([UNSTABLE, STABLE, STABLE])))
    _, (low,), (high,) = again.bounds()
    assert low == -np.inf and high == again.log_kappa[0]


def blade(scale=1.0, signs=(1.0, 1.0), nodes=("a", "b"), amplitude=((3.0, 1.0), (-1.0, 2.0)), damping=1e-3):
    shape = np.array(amplitude) * np.array(signs)[:, None]
    shape = shape[:, [("a", "b").index(node) for node in nodes]]
    return Blade("b", nodes, damping, [ModalState(0.0, scale * np.array([100.0, 400.0]), shape)])


def name_of(made, contact, speed=50.0):
    return ServedCases.from_answers(crossings([speed], made, contact)).case_digests()[0]


BOTH = {"a": 1.0, "b": 0.5}
ARCS = [[0.1, 0.3], [0.6, 0.7]]


def test_the_same_case_has_the_same_name_however_it_is_told():
    contact = ContactConfiguration(BOTH, ARCS)
    first = name_of(blade(), contact)
    assert name_of(blade(signs=(1.0, -1.0)), contact) == first
    assert name_of(blade(nodes=("b", "a")), contact) == first
    assert name_of(blade(scale=3.0), contact, 150.0) == first
    turned = ContactConfiguration(BOTH, [[0.0, 0.1], [0.5, 0.7]])
    assert name_of(blade(), turned) == first
    past_one = ContactConfiguration(BOTH, [[0.4, 0.5], [0.9, 1.1]])
    assert name_of(blade(), past_one) == first


def test_another_case_has_another_name():
    contact = ContactConfiguration(BOTH, ARCS)
    names = {
        name_of(blade(), contact).item(),
        name_of(blade(damping=1.001e-3), contact).item(),
        name_of(blade(amplitude=((3.0, 1.0), (-1.0, 2.01))), contact).item(),
        name_of(blade(), contact, 50.01).item(),
        name_of(blade(), ContactConfiguration(BOTH)).item(),
        name_of(blade(), ContactConfiguration(BOTH, [[0.1, 0.3], [0.6, 0.701]])).item(),
        name_of(blade(), ContactConfiguration(BOTH, [[0.1, 0.25], [0.6, 0.75]])).item(),
        name_of(blade(), ContactConfiguration({"a": 1.0, "b": 0.51}, ARCS)).item(),
    }
    assert len(names) == 8


def test_an_answer_given_twice_is_kept_once_by_whomever(kept, folder):
    for _ in range(3):
        kept.keep(crossings(SPEEDS))
    kept.flush()
    kept.keep(crossings(SPEEDS))
    kept.keep(crossings(SPEEDS, ke=9.1e3))  # the same cases at another K_e
    kept.flush()
    other = ServedAnswers(folder)
    other.keep(crossings(SPEEDS))
    other.keep(crossings([123.0]))
    other.close()
    rows = sum(len(served_chunks.read_chunk(path)) for path in served_chunks.chunks(folder))
    assert rows == len(ServedAnswers.read(folder)) == 2 * len(SPEEDS) + 1


WRITER = """
import sys
from pathlib import Path
import numpy as np
from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from training.exact_answers import ExactAnswers
from training.served_answers import ServedAnswers
kept, first = ServedAnswers(Path(sys.argv[1])), int(sys.argv[2])
for i in range(20):
    speeds = 100.0 + first + np.arange(10 * i, 10 * i + 10) / 4
    kept.keep(ExactAnswers.from_crossings(
        example_blade("nasa_rotor_37"), ContactConfiguration.at("LE"), speeds, np.full(10, 9e3), 1e5))
    if i % 5 == 0:
        kept.flush()
kept.close()
"""


def test_several_processes_keep_all_their_answers_in_one_folder(tmp_path):
    started = [
        subprocess.Popen([sys.executable, "-c", WRITER, str(tmp_path), first]) for first in ("0", "20", "40")
    ]
    assert [process.wait(120) for process in started] == [0, 0, 0]
    expected = {100.0 + first + i / 4 for first in (0, 20, 40) for i in range(200)}
    found = ServedAnswers.read(tmp_path)
    assert sorted(found.speed_hz) == sorted(expected)


def test_nothing_to_keep_is_nothing_to_complain_about(tmp_path, caplog):
    with caplog.at_level(logging.WARNING):
        kept = ServedAnswers(tmp_path / "served")
        kept.flush()
        kept.keep(crossings([]))
        kept.close()
    assert not caplog.records and list((tmp_path / "served").iterdir()) == []
    nothing = ServedAnswers.read(tmp_path / "served")
    assert len(nothing) == 0 == nothing.for_training(DesignSpace()).provenance["cases"]
    assert len(nothing.bounds()[0]) == 0


def test_several_threads_keep_all_their_answers(kept, folder):
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda i: kept.keep(crossings([100.0 + i / 4])), range(400)))
    kept.flush()
    assert len(ServedAnswers.read(folder)) == 400 and kept.dropped == 0
    assert len(served_chunks.chunks(folder)) == 1


def test_the_oldest_answers_go_when_there_are_too_many(tmp_path, monkeypatch):
    monkeypatch.setattr(served_answers, "CHUNK_ROWS", 10)
    kept = ServedAnswers(tmp_path, most_rows=35)
    for i in range(10):
        kept.keep(crossings(100.0 + 10 * i + np.arange(10)))
        kept.flush()
    kept.keep(crossings([100.0]))  # gone meanwhile, and so new
    kept.close()
    speeds = sorted(ServedAnswers.read(tmp_path).speed_hz)
    assert speeds == [100.0, *np.arange(170.0, 200.0)]


def test_damaged_files_are_skipped_with_a_warning(tmp_path, caplog):
    for i in range(4):
        kept = ServedAnswers(tmp_path)
        kept.keep(crossings([99.0 + i]))
        kept.close()
    altered, first, second, _ = served_chunks.chunks(tmp_path)
    with np.load(altered) as whole:
        arrays = dict(whole)
    np.savez(altered, **{**arrays, "ke": 2 * arrays["ke"]})
    first.write_bytes(first.read_bytes()[:-40])
    second.write_bytes(second.read_bytes().replace(b"speed_hz", b"speed_hx"))
    with caplog.at_level(logging.WARNING):
        assert ServedAnswers.read(tmp_path).speed_hz.tolist() == [102.0]
    assert sum("skipped" in record.message for record in caplog.records) == 3
    kept = ServedAnswers(tmp_path)
    kept.keep(crossings([100.0]))
    kept.close()
    assert sorted(ServedAnswers.read(tmp_path).speed_hz) == [100.0, 102.0]


def test_a_file_replaced_while_it_is_read_is_not_missed(kept, folder, monkeypatch):
    kept.keep(crossings([100.0]))
    kept.flush()
    listed = served_chunks.chunks

    def and_then_replaced(where):
        paths = listed(where)
        monkeypatch.setattr(served_chunks, "chunks", listed)
        kept.keep(crossings([101.0]))
        kept.flush()
        assert not paths[0].exists()
        return paths

    monkeypatch.setattr(served_chunks, "chunks", and_then_replaced)
    assert sorted(ServedAnswers.read(folder).speed_hz) == [100.0, 101.0]


def test_a_full_disk_costs_the_answers_of_that_time_and_no_others(kept, folder, monkeypatch, caplog):
    def full(*arguments):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(served_chunks.Path, "write_bytes", full)
    with caplog.at_level(logging.ERROR):
        for speed in (100.0, 101.0):
            kept.keep(crossings([speed]))
            kept.flush()
    monkeypatch.undo()
    assert kept.dropped == 2 and caplog.text.count("No space left") == 1
    kept.keep(crossings([100.0]))
    kept.flush()
    assert ServedAnswers.read(folder).speed_hz.tolist() == [100.0]
    assert [p.name for p in folder.iterdir() if p.suffix != ".npz"] == []


def test_answers_that_come_too_fast_are_dropped_and_nobody_waits(tmp_path, monkeypatch):
    going = threading.Event()
    take = ServedAnswers._take
    monkeypatch.setattr(ServedAnswers, "_take", lambda self, answers: (going.wait(20.0), take(self, answers)))
    kept = ServedAnswers(tmp_path, most_waiting=10)
    for i in range(15):
        kept.keep(crossings([100.0 + i]))
    assert kept.dropped == 5
    going.set()
    kept.close()
    assert sorted(ServedAnswers.read(tmp_path).speed_hz) == [100.0 + i for i in range(10)]


def test_an_answer_is_given_whatever_becomes_of_its_keeping(model, caplog):
    def fail(answers):
        raise RuntimeError("no room")

    with caplog.at_level(logging.ERROR):
        found = Screener(model, on_exact=fail).points(ROTOR, LE, SPEEDS, np.full(25, 9e3), "exact")
    np.testing.assert_array_equal(
        found.stable, Screener(model).points(ROTOR, LE, SPEEDS, np.full(25, 9e3), "exact").stable
    )
    assert "no room" in caplog.text


def test_what_a_case_has_no_place_for_is_left_out():
    six = Blade("six", ("a",), 1e-3, [ModalState(0.0, 100.0 * np.arange(1, 7), np.ones((6, 1)))])
    still = Blade("still", ("a",), 1e-3, [ModalState(0.0, [100.0], [[0.0]])])
    smooth = ContactConfiguration.at("LE", engagement=FourierEngagement(0.5, [0.4]))
    five = ContactConfiguration({"LE": 1.0}, [[i / 5, i / 5 + 0.1] for i in range(5)])
    left_out = [
        crossings([50.0], six, ContactConfiguration.at("a")),
        crossings([50.0], still, ContactConfiguration.at("a")),
        crossings([200.0], ROTOR, smooth),
        crossings([200.0], ROTOR, five),
        crossings([]),
    ]
    assert [len(ServedCases.from_answers(answers)) for answers in left_out] == [0] * 5
    all_round = ContactConfiguration({"LE": 1.0}, [[0.0, 0.5], [0.5, 1.0]])
    assert ServedCases.from_answers(crossings([200.0], ROTOR, all_round)).permanent.all()


def test_served_cases_join_the_training_set_with_labels_of_their_own_and_are_on_record(kept, folder):
    kept.keep(crossings(SPEEDS))
    kept.keep(crossings(SPEEDS, ke=123.0))  # what was said at a K_e is not the label
    kept.keep(crossings([20.0, 250.0], contact=TWO_ARCS))
    kept.keep(crossings([20.0]))  # below the design space
    kept.flush()
    read = ServedAnswers.read(folder)
    served = read.for_training(DesignSpace())
    settings = TrainingSettings(first_cases=16, rounds=0, threads=1)
    (with_them, _), (without, _) = (asked(settings, s, folder / "labels") for s in (served, None))
    cases, kappa = with_them.labelled
    joined, found = cases[without.labels :], kappa[without.labels :]
    assert len(joined) == len(SPEEDS) + 1 and without.labels == 14
    exact = boundary(ROTOR, LE, SPEEDS, 1e6).critical_ke
    permanent = joined.permanent
    critical = (found * joined.stiffness_scale)[permanent]
    np.testing.assert_allclose(critical[np.argsort(joined.speed_hz[permanent])], exact, rtol=1e-6)
    with_arcs = boundary(ROTOR, TWO_ARCS, np.array([250.0]), 1e6).critical_ke
    np.testing.assert_allclose((found * joined.stiffness_scale)[~permanent], with_arcs, rtol=3e-4)
    assert (served.provenance["cases"], served.provenance["left_out"]) == (len(SPEEDS) + 1, 2)
    other = replace(read, speed_hz=read.speed_hz * 1.01).for_training(DesignSpace()).provenance
    assert other["sha256"] != served.provenance["sha256"]


def test_a_folder_that_is_not_there_or_cannot_be_made_is_named(tmp_path):
    with pytest.raises(InvalidInput, match="kept its answers in"):
        ServedAnswers.read(tmp_path / "nothing")
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InvalidInput, match="cannot be made"):
        ServedAnswers(tmp_path / "file" / "served")
