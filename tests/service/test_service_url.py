"""An address that no service can have is refused where it was given, and not when it does not answer."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from sdm_core.errors import InvalidInput
from service import cli
from service.client import AsyncClient, Client
from service.service_url import checked_service_url

NONSENSE = {
    "nonsense": "http://nonsense",
    "127.0.0.1:8000": "http://127.0.0.1:8000",
    "rub.example/ask": "http://rub.example/ask",
    "": "http://127.0.0.1:8000",
    "  ": "http://127.0.0.1:8000",
    "http://": "names no host",
    "http://:80": "names no host",
    "http://a b": "spaces",
    "http://a\nb": "control characters",
    "http://127.0.0.1:99999999": "ports",
    "http://127.0.0.1:http": "ports",
    "http://127.0.0.1:0": "no port 0",
    "http://[::1": "IPv6",
    "ftp://rub.example": "http or https",
    "tcp://127.0.0.1:8786": "http or https",
    "http://rub.example/?key=1": "leave out",
}


@pytest.mark.parametrize("kind", [Client, AsyncClient])
@pytest.mark.parametrize("url", NONSENSE)
def test_a_client_is_not_made_for_an_address_of_no_service(kind, url):
    with pytest.raises(InvalidInput) as refused:
        kind(url)
    assert refused.value.field == "base_url" and refused.value.value
    assert NONSENSE[url] in refused.value.remedy


@pytest.mark.parametrize("url", [None, 8000, b"http://a"])
def test_an_address_is_text(url):
    with pytest.raises(InvalidInput, match="as text"):
        Client(url)


@pytest.mark.parametrize(
    "url",
    [
        "http://127.0.0.1:8000",
        "https://rub.example",
        "http://[::1]:8000/",
        "http://user:secret@rub.example/below",
        "HTTP://RUB:1",
        " http://rub\n",
    ],
)
def test_the_address_of_a_service_stays_as_it_is(url):
    assert checked_service_url(url) == url.strip().rstrip("/")
    with Client(url) as client:
        assert client.base_url == url.strip().rstrip("/")


def test_a_password_in_an_address_is_not_repeated():
    for url in ("http://user:secret@", "user:secret@rub.example", "http://user:secret@rub:x"):
        with pytest.raises(InvalidInput) as refused:
            checked_service_url(url)
        assert "secret" not in str(refused.value)


def test_commands_say_whether_it_was_typed_or_stands_in_the_environment(monkeypatch):
    typed = CliRunner().invoke(cli.app, ["batch", "list", "--url", "nonsense"])
    assert typed.exit_code == 2 and "--url = nonsense: give http://" in typed.stderr
    other = CliRunner().invoke(cli.app, ["map", "nasa_rotor_37", "--url", "nonsense"])
    assert other.exit_code == 2 and "--url = nonsense" in other.stderr
    monkeypatch.setenv("RUBSCREEN_URL", "nonsense")
    stands = CliRunner().invoke(cli.app, ["batch", "list"])
    assert stands.exit_code == 2 and "RUBSCREEN_URL = nonsense: give http://" in stands.stderr
    assert stands.stderr.count("\n") == 1
