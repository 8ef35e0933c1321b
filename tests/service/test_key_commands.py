"""`rubscreen keys`, and what `rubscreen serve` asks before it listens where others can come."""

from __future__ import annotations

import json
import time
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from sdm_core.errors import InvalidInput
from service import cli
from service.commands.admission import settled
from service.commands.keys import expiry
from service.demo import running_service
from service.records.database import FILE, open_database
from service.records.keys import KeyStore, split_key
from service.roles import Role
from service.settings import Settings, default_data_folder

DAY_S = 86400.0


@pytest.fixture(autouse=True)
def home(tmp_path, monkeypatch) -> Path:
    """Where data go unless a test says otherwise."""
    for name in ("RUBSCREEN_DATA_FOLDER", "RUBSCREEN_DATABASE_URL", "RUBSCREEN_AUTH"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    return tmp_path / "share" / "rubscreen"


@pytest.fixture
def keys():
    """Run `rubscreen keys`."""

    def run(*arguments: str):
        return CliRunner().invoke(cli.app, ["keys", *arguments], env={"COLUMNS": "200", "TERM": "dumb"})

    return run


def stored(folder: Path) -> list:
    database = open_database(folder)
    try:
        return KeyStore(database).all()
    finally:
        database.close()


def test_a_new_key_is_all_there_is_on_stdout_and_works(keys, home):
    made = keys("create", "design office", "--role", "submit", "--expires", "90d", "--max-active-jobs", "4")
    assert made.exit_code == 0, made.output
    key_id, secret = split_key(made.stdout.removesuffix("\n"))
    (key,) = stored(home)
    assert (key.id, key.name, key.role) == (key_id, "design office", Role.submit)
    assert key.opened_by(secret) and not key.opened_by(secret[::-1])
    assert key.expires_at == pytest.approx(key.created_at + 90 * DAY_S, abs=5.0)
    assert key.limits.max_active_jobs == 4 and key.limits.requests_per_minute is None
    assert key_id in made.stderr and "submit" in made.stderr and secret not in made.stderr


def test_two_keys_of_one_name_are_two_keys(keys, home):
    texts = {keys("create", "office", "--role", "read").stdout for _ in range(2)}
    assert len(texts) == len({key.id for key in stored(home)}) == 2


def test_the_list_shows_every_key_and_no_secret(keys, home):
    texts = [keys("create", name, "--role", "read").stdout.strip() for name in ("first [b]", "second")]
    gone = split_key(texts[0])[0]
    assert keys("revoke", gone).exit_code == 0
    shown, document = keys("list").stdout, keys("list", "--json", "-")
    listed = json.loads(document.stdout)["keys"]
    assert [(key["name"], key["state"]) for key in listed] == [("first [b]", "revoked"), ("second", "usable")]
    assert listed[0]["revoked_at"].endswith("+00:00") and listed[1]["revoked_at"] is None
    assert "first [b]" in shown and "second" in shown and gone in shown
    for text in texts:
        assert split_key(text)[1] not in shown + document.output
    assert "secret" not in document.stdout


def test_without_keys_the_list_says_how_to_make_one(keys):
    assert "rubscreen keys create" in keys("list").stdout


@pytest.mark.parametrize("given", ["id", "whole key"])
def test_a_key_is_revoked_by_its_id_or_itself_without_being_shown(keys, home, given):
    text = keys("create", "office", "--role", "admin").stdout.strip()
    key_id, secret = split_key(text)
    done = keys("revoke", key_id if given == "id" else text)
    assert done.exit_code == 0 and secret not in done.output
    first = stored(home)[0].revoked_at
    assert first is not None
    assert keys("revoke", key_id).exit_code == 0
    assert stored(home)[0].revoked_at == first  # when it was lost stays on record


def test_a_key_that_is_not_there_cannot_be_revoked(keys):
    secret = "0" * 64
    for given in ("0123456789ab", f"rub_0123456789ab_{secret}"):
        refused = keys("revoke", given)
        assert refused.exit_code == 2
        assert "0123456789ab" in refused.stderr and "keys list" in refused.stderr
        assert secret not in refused.output


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["office", "--role", "submit", "--expires", "soon"], "--expires"),
        (["office", "--role", "submit", "--expires", "2001-01-01"], "--expires"),
        (["office", "--role", "submit", "--expires", "0d"], "--expires"),
        (["office", "--role", "submit", "--requests-per-minute", "0"], "--requests-per-minute"),
        (["  ", "--role", "submit"], "name"),
        (["a\nb", "--role", "submit"], "name"),
        (["x" * 201, "--role", "submit"], "name"),
        (["office", "--role", "owner"], "owner"),
        (["office"], "--role"),
    ],
)
def test_a_key_that_makes_no_sense_is_not_made(keys, home, arguments, named):
    refused = keys("create", *arguments)
    assert refused.exit_code == 2
    assert named in refused.stderr
    assert not refused.stdout
    assert not (home / FILE).exists() or stored(home) == []


@pytest.mark.parametrize(
    ("text", "after_s"),
    [("12h", DAY_S / 2), ("90d", 90 * DAY_S), ("4w", 28 * DAY_S), ("1970-01-03", 2 * DAY_S)],
)
def test_an_expiry_is_a_span_or_a_date(text, after_s):
    assert expiry(text, 0.0) == after_s


def test_a_time_with_a_zone_is_that_time():
    assert expiry("1970-01-02T02:00+02:00", 0.0) == DAY_S


def test_data_are_where_the_desktop_keeps_data(monkeypatch, tmp_path):
    assert default_data_folder() == tmp_path / "share" / "rubscreen"
    monkeypatch.setenv("HOME", "/home/somebody")
    for relative in ("", "share"):
        monkeypatch.setenv("XDG_DATA_HOME", relative)
        assert default_data_folder() == Path("/home/somebody/.local/share/rubscreen")
    assert Settings().data_folder is None


def test_keys_are_kept_in_the_folder_told(keys, home, tmp_path, monkeypatch):
    monkeypatch.setenv("RUBSCREEN_DATA_FOLDER", str(tmp_path / "environment"))
    keys("create", "one", "--role", "read")
    keys("create", "two", "--role", "read", "--data", str(tmp_path / "option"))
    assert [key.name for key in stored(tmp_path / "environment")] == ["one"]
    assert [key.name for key in stored(tmp_path / "option")] == ["two"]
    monkeypatch.setenv("RUBSCREEN_DATABASE_URL", f"sqlite:///{tmp_path / 'elsewhere.sqlite'}")
    keys("create", "three", "--role", "read")
    assert "three" in keys("list").stdout and "one" not in keys("list").stdout
    assert not home.exists()


def test_a_data_folder_that_cannot_be_made_is_named(keys, tmp_path):
    (tmp_path / "file").touch()
    refused = keys("list", "--data", str(tmp_path / "file" / "data"))
    assert refused.exit_code == 2
    assert "another folder" in refused.stderr


def _settled(home: Path, auth: str, address: str, open_to_all: bool = False) -> str:
    options = Settings(auth=auth, data_folder=home)
    return settled(options, "host", address, open_to_all=open_to_all).auth


@pytest.mark.parametrize("address", ["127.0.0.1", "127.0.0.2", "::1"])
def test_on_the_loopback_no_keys_are_asked_for_unless_told(home, address, capsys):
    assert _settled(home, "auto", address) == "auto"
    assert _settled(home, "off", address) == "off"
    assert capsys.readouterr().err == ""
    with pytest.raises(InvalidInput, match="keys create"):
        _settled(home, "on", address)


@pytest.mark.parametrize("address", ["0.0.0.0", "::", "192.0.2.7", "2001:db8::1"])
def test_elsewhere_the_service_starts_with_a_key_or_open_when_told(home, address, capsys, keys):
    with pytest.raises(InvalidInput, match=r"keys create .*--open"):
        _settled(home, "auto", address)
    assert _settled(home, "auto", address, open_to_all=True) == "off"
    assert f"whoever reaches {address}" in capsys.readouterr().err
    assert _settled(home, "off", address) == "off"
    assert "warning" in capsys.readouterr().err
    keys("create", "office", "--role", "read", "--data", str(home))
    assert _settled(home, "auto", address) == _settled(home, "on", address) == "on"
    assert capsys.readouterr().err == ""


def test_keys_of_no_use_do_not_count(home):
    database = open_database(home)
    store = KeyStore(database)
    store.revoke(store.create("gone", Role.admin)[0].id)
    store.create("past", Role.admin, time.time() + 0.05)
    database.close()
    time.sleep(0.06)
    with pytest.raises(InvalidInput, match="none is usable"):
        _settled(home, "auto", "0.0.0.0")


def test_open_and_keys_at_once_are_refused(home):
    with pytest.raises(InvalidInput, match="leave out one"):
        _settled(home, "on", "127.0.0.1", open_to_all=True)


def test_serve_refuses_an_address_of_others_without_keys(home):
    refused = CliRunner().invoke(cli.app, ["serve", "--host", "0.0.0.0", "--port", "0"])
    assert refused.exit_code == 2
    assert "--host = 0.0.0.0" in refused.stderr
    assert str(home) in refused.stderr and refused.stderr.count("\n") == 1


def test_the_demonstration_keeps_off_the_users_data_and_needs_no_key(home, tmp_path, monkeypatch):
    monkeypatch.setenv("RUBSCREEN_DATA_FOLDER", str(tmp_path / "mine"))
    monkeypatch.setenv("RUBSCREEN_DATABASE_URL", f"sqlite:///{tmp_path / 'mine.sqlite'}")
    monkeypatch.setenv("RUBSCREEN_AUTH", "on")
    before = set(tmp_path.iterdir())
    with running_service(tmp_path / "log") as url:
        assert httpx.get(f"{url}/v1/models", trust_env=False).status_code == 200
    assert set(tmp_path.iterdir()) - before == {tmp_path / "log"}
    assert not home.exists()
