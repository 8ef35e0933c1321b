"""Nobody gets in who should not: every role on every route, and keys of every wrong kind."""

from __future__ import annotations

import asyncio
import hashlib
import logging
import re
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from fastapi.routing import iter_route_contexts
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy.exc import OperationalError

from sdm_core.errors import InvalidInput
from service.app import create_app
from service.client import Client, ServiceProblem
from service.records.database import open_database
from service.records.keys import KEYS, KeyStore, split_key
from service.rest.access import (
    ADMIN,
    ANONYMOUS,
    READ,
    SUBMIT,
    NotAllowed,
    NotAuthenticated,
    guarded_routes,
    is_open,
)
from service.rest.errors import NotReady
from service.rest.gate import Access
from service.rest.key_check import KNOWN_FOR_S, KeyCheck
from service.roles import Role
from service.settings import Settings

# What is asked in a body and changes nothing.
QUESTIONS = {
    "/v1/stability",
    "/v1/boundary",
    "/v1/sensitivities",
    "/v1/map",
    "/v1/blades",
    "/v1/campbell",
    "/v1/lobes",
    "/v1/damping",
}


def service(options: Settings, **parts: Any) -> FastAPI:
    """The service, with a route of each role beside its own, so that each is tried whatever those ask for."""
    app = create_app(options, **parts)
    app.get("/v1/tried", dependencies=[READ])(lambda: "read")
    app.post("/v1/tried", dependencies=[READ, SUBMIT])(lambda: "submitted")
    app.post("/v1/models/{model}/tried", dependencies=[ADMIN, READ])(lambda model: "exchanged")
    return app


GUARDED = [
    (method, route.path_format, role)
    for route, role in guarded_routes(service(Settings()).routes)
    for method in sorted(route.methods)
]
ROUTES = pytest.mark.parametrize(("method", "path", "needs"), GUARDED, ids=lambda part: str(part))


def unguarded(app: FastAPI) -> set[str]:
    """Paths that anybody may ask for."""
    guarded = {id(route.original_route) for route, _ in guarded_routes(app.routes)}
    routes = [route for route in iter_route_contexts(app.routes) if id(route.original_route) not in guarded]
    return {route.path for route in routes}


@dataclass
class Keyed:
    """A service that asks for keys, with one of each role."""

    url: str
    http: httpx.Client
    data: Path
    store: KeyStore
    keys: dict[Role, str]

    def get(self, headers: dict | None = None, path: str = "/v1/models") -> httpx.Response:
        return self.http.get(path, headers=headers)


def bearer(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


@pytest.fixture(scope="module")
def keyed(tmp_path_factory, serving, new_screener) -> Iterator[Keyed]:
    folder = tmp_path_factory.mktemp("keyed")
    (folder / "models").mkdir()
    options = Settings(
        data_folder=folder / "data",
        models_folder=folder / "models",  # a role tried on a route may change models
        auth="on",
        requests_per_minute=1_000_000,
    )
    database = open_database(options.data_folder)
    store = KeyStore(database)
    keys = {role: store.create(f"has {role.value}", role)[1] for role in Role}
    with (
        serving(service(options, screener=new_screener())) as url,
        httpx.Client(base_url=url, timeout=20.0) as http,
    ):
        yield Keyed(url, http, options.data_folder, store, keys)
    database.close()


@pytest.fixture
def store(tmp_path) -> Iterator[KeyStore]:
    database = open_database(tmp_path / "data")
    yield KeyStore(database)
    database.close()


def test_every_route_asks_for_a_role_but_health_documentation_and_the_files_of_the_page():
    paths = unguarded(create_app())
    documents = {"/docs", "/docs/oauth2-redirect", "/openapi.json", "/docs/assets"}
    assert paths == {"/healthz", "/readyz", *documents, "/", "/page"}
    assert all(is_open(path) or path == "/docs/assets" for path in paths)
    assert not is_open("/page/../v1/models") and not is_open("/pages")


def test_a_route_without_a_guard_is_noticed():
    app = create_app()
    app.get("/v1/guarded", dependencies=[READ])(lambda: None)
    app.get("/v1/forgotten")(lambda: None)
    assert unguarded(app) - unguarded(create_app()) == {"/v1/forgotten"}


@ROUTES
def test_looking_needs_read_changing_needs_more_and_models_are_exchanged_by_admins(method, path, needs):
    if method in ("GET", "HEAD") or path in QUESTIONS:
        assert needs is Role.read
    elif path.startswith("/v1/models"):
        assert needs is Role.admin
    else:
        assert needs in (Role.submit, Role.admin)


@pytest.mark.parametrize("role", list(Role))
@ROUTES
def test_every_role_may_do_what_its_routes_ask_for_and_nothing_else(
    keyed, problem, method, path, needs, role
):
    answer = _ask(keyed, method, path, bearer(keyed.keys[role]))
    if role.covers(needs):
        assert answer.status_code not in (401, 403), answer.text
    else:
        refused = problem(answer, 403, "role")
        assert f"'{role.value}'" in refused["value"] and needs.value in refused["remedy"]


@ROUTES
def test_without_a_key_every_route_says_which_role_it_needs(keyed, problem, method, path, needs):
    answer = _ask(keyed, method, path, {})
    refused = problem(answer, 401, "key")
    assert answer.headers["www-authenticate"] == 'Bearer realm="rubscreen"'
    assert refused["value"] == "missing"
    assert re.search(rf"needs role ({needs.value}\b|.* or {needs.value}\b)", refused["remedy"])


def _ask(keyed: Keyed, method: str, path: str, headers: dict[str, str]) -> httpx.Response:
    filled = re.sub(r"{[^}]*}", "0" * 16, path)
    with keyed.http.stream(method, filled, headers=headers) as answer:
        if answer.status_code >= 400:  # others may be streams without an end
            answer.read()
        return answer


@pytest.mark.parametrize("path", ["/healthz", "/readyz", "/docs", "/openapi.json"])
def test_health_and_documentation_need_no_key(keyed, path):
    assert keyed.get(path=path).status_code == 200


def test_a_path_that_is_not_there_is_told_only_to_those_with_a_key(keyed, problem):
    assert "any role" in problem(keyed.get(path="/v1/nothing"), 401, "key")["remedy"]
    problem(keyed.get(bearer(keyed.keys[Role.read]), "/v1/nothing"), 404, "path")


def test_a_key_goes_in_either_header_and_the_scheme_in_any_case(keyed):
    key = keyed.keys[Role.read]
    for headers in (
        {"X-API-Key": key},
        {"Authorization": f"bEARER  {key}"},
        {"Authorization": "Basic dTpw", "X-API-Key": key},
    ):
        assert keyed.get(headers).status_code == 200, headers


WRONG: dict[str, Callable[[str], str | bytes]] = {
    "truncated": lambda key: key[:-1],
    "lengthened": lambda key: key + "0",
    "secret of another": lambda key: key[:-1] + ("0" if key[-1] != "0" else "1"),
    "unknown id": lambda key: "rub_" + "0" * 12 + key[16:],
    "upper case": lambda key: key[:17] + key[17:].upper(),
    "prefix only": lambda key: "rub_",
    "id without secret": lambda key: key[:17],
    "secret without id": lambda key: key[17:],
    "another prefix": lambda key: "gub" + key[3:],
    "quoted": lambda key: f'"{key}"',
    "twice": lambda key: f"{key} {key}",
    "full-width digits": lambda key: (key[:-1] + "１").encode(),
    "unicode": lambda key: "rub_schlüssel".encode(),
    "not utf-8": lambda key: b"rub_\xff\xfe",
    "very long": lambda key: key * 200,
    "a percentage": lambda key: "%s%n%00",
}


@pytest.mark.parametrize("header", ["Authorization", "X-API-Key"])
@pytest.mark.parametrize("kind", WRONG)
def test_a_key_that_is_not_one_is_refused_and_not_repeated(keyed, problem, caplog, kind, header):
    key = keyed.keys[Role.admin]
    sent = WRONG[kind](key)
    value = sent if isinstance(sent, bytes) else sent.encode()
    with caplog.at_level(logging.DEBUG, "rubscreen"):
        answer = keyed.get({header: b"Bearer " + value if header == "Authorization" else value})
    refused = problem(answer, 401, "key")
    assert refused["value"] in ("not a key", "unknown")
    assert 'error="invalid_token"' in answer.headers["www-authenticate"]
    for shown in (answer.text, str(answer.headers), caplog.text):
        assert key[17:40] not in shown and "schl" not in shown


@pytest.mark.parametrize("value", ["Bearer", "", "Basic dTpw", "Token x"])
def test_a_header_without_a_key_is_refused(keyed, problem, value):
    problem(keyed.get({"Authorization": value}), 401, "key")


@given(st.binary(max_size=120).filter(lambda sent: not re.search(rb"[\x00-\x08\x0a-\x1f\x7f]", sent)))
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_sent_as_a_key_is_refused_with_401(keyed, sent):
    assert keyed.get({"Authorization": (b"Bearer " + sent).strip()}).status_code == 401
    assert keyed.get({"X-API-Key": sent.strip()}).status_code == 401


def test_an_expired_and_a_revoked_key_say_so_to_whoever_has_their_secret(keyed, problem):
    soon, expired = keyed.store.create("visitor", Role.admin, time.time() + 0.2)
    gone, revoked = keyed.store.create("gone", Role.admin)
    keyed.store.revoke(gone.id)
    time.sleep(0.25)
    for key, what in ((expired, f"{soon.id} (visitor), expired"), (revoked, f"{gone.id} (gone), revoked")):
        assert problem(keyed.get(bearer(key)), 401, "key")["value"] == what
        stranger = problem(keyed.get(bearer(key[:17] + "0" * 64)), 401, "key")
        assert stranger["value"] == "unknown"


def test_a_refusal_does_not_wait_for_the_body(keyed):
    host, port = httpx.URL(keyed.url).host, httpx.URL(keyed.url).port
    with socket.create_connection((host, port), timeout=10.0) as sock:
        sock.sendall(b"POST /v1/map HTTP/1.1\r\nHost: x\r\nContent-Length: 1000000\r\n\r\n{")
        assert sock.recv(65536).startswith(b"HTTP/1.1 401")


def test_the_database_has_a_hash_and_no_file_has_the_secret(keyed):
    text = keyed.keys[Role.admin]
    assert keyed.get(bearer(text)).status_code == 200
    key_id, secret = split_key(text)
    content = b"".join(path.read_bytes() for path in keyed.data.rglob("*") if path.is_file())
    assert hashlib.sha256(secret.encode()).digest() in content and key_id.encode() in content
    assert secret.encode() not in content and bytes.fromhex(secret) not in content
    assert "secret" not in "".join(set(KEYS.c.keys()) - {"secret_sha256"})


def test_the_log_says_whose_request_it_was(keyed, caplog):
    key = keyed.keys[Role.read]
    with caplog.at_level(logging.INFO, "rubscreen"):
        keyed.get(bearer(key))
        deadline = time.monotonic() + 5.0
        while key[4:16] not in caplog.text and time.monotonic() < deadline:
            time.sleep(0.01)
    assert key[4:16] in caplog.text
    assert key[17:] not in caplog.text


def test_the_client_sends_its_key_or_that_of_the_environment(keyed, monkeypatch):
    key = keyed.keys[Role.read]
    monkeypatch.delenv("RUBSCREEN_API_KEY", raising=False)
    with Client(keyed.url) as stranger, pytest.raises(ServiceProblem, match="missing"):
        stranger.models()
    with Client(keyed.url, key=key) as client:
        assert client.models() == []
    monkeypatch.setenv("RUBSCREEN_API_KEY", f"{key}\n")  # as read from a file
    with Client(keyed.url) as client:
        assert client.models() == []


def test_a_key_that_no_header_can_carry_is_refused_without_showing_it():
    for key in ("rub_schlüssel", "rub_a\nb"):
        with pytest.raises(InvalidInput) as refused:
            Client("http://127.0.0.1:9", key=key)
        assert "rub" not in str(refused.value).replace("rubscreen", "")


class Clock:
    """A time that stands still until it is told."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def test_a_revoked_key_is_of_no_use_after_five_seconds_on_any_replica(store):
    assert KNOWN_FOR_S < 5.0

    async def scene() -> None:
        key, text = store.create("gone", Role.read)
        clock = Clock()
        replicas = [KeyCheck(store, clock), KeyCheck(store, clock)]
        for replica in replicas:
            assert (await replica.check(text)).id == key.id
        store.revoke(key.id)
        clock.now += 4.99
        for replica in replicas:
            with pytest.raises(NotAuthenticated, match="revoked"):
                await replica.check(text)
            replica.close()

    asyncio.run(scene())


def test_a_known_key_is_asked_for_once_however_many_come_with_it(store, monkeypatch):
    _, text = store.create("busy", Role.read)
    asked, find = [], store.find
    monkeypatch.setattr(store, "find", lambda key_id: asked.append(key_id) or find(key_id))

    async def scene() -> None:
        clock = Clock()
        check = KeyCheck(store, clock)
        await asyncio.gather(*(check.check(text) for _ in range(50)))
        assert len(asked) == 1
        clock.now += KNOWN_FOR_S
        await asyncio.gather(*(check.check(text) for _ in range(50)))
        assert len(asked) == 2
        check.close()

    asyncio.run(scene())


def test_while_the_database_does_not_answer_the_service_is_not_ready(store, monkeypatch):
    _, text = store.create("any", Role.read)

    def broken(key_id: str) -> None:
        raise OperationalError("select", {}, Exception("gone"))

    monkeypatch.setattr(store, "find", broken)

    async def scene() -> None:
        check = KeyCheck(store)
        with pytest.raises(NotReady):
            await check.check(text)
        check.close()

    asyncio.run(scene())


def test_the_last_use_is_written_at_most_once_a_minute(store):
    key, text = store.create("seen", Role.read)

    async def scene() -> None:
        check = KeyCheck(store)
        for _ in range(5):
            await check.check(text)
        check.close()

    asyncio.run(scene())
    first = store.find(key.id).last_used_at
    assert first is None or first > key.created_at
    store.used(key.id, 1e10)
    for later, expected in ((59.9, 1e10), (60.0, 1e10 + 60.0), (119.0, 1e10 + 60.0)):
        store.used(key.id, 1e10 + later)
        assert store.find(key.id).last_used_at == expected


def _scope(server: str, client: str = "127.0.0.1", **headers: str) -> dict:
    sent = [(name.lower().encode(), value.encode()) for name, value in headers.items()]
    return {
        "type": "http",
        "path": "/v1/models",
        "server": (server, 8000),
        "client": (client, 5),
        "headers": sent,
    }


def test_under_any_server_auto_asks_for_keys_where_other_machines_can_come():
    access = Access.opened(Settings(), None)
    for server in ("127.0.0.1", "::1", "127.3.2.1"):
        assert asyncio.run(access.admit(_scope(server)))[0] == ANONYMOUS
    for server in ("10.0.0.7", "2001:db8::1", "::ffff:10.0.0.7"):
        with pytest.raises(NotAuthenticated, match="this service has none"):
            asyncio.run(access.admit(_scope(server)))


def test_with_auth_off_everybody_is_an_admin_and_keys_do_not_matter():
    access = Access.opened(Settings(auth="off"), None)
    scope = _scope("10.0.0.7", "10.0.0.8", Authorization="Bearer rub_x", Host="rub.example.com")
    assert asyncio.run(access.admit(scope))[0] == ANONYMOUS


def test_keys_without_a_place_for_them_are_refused_at_start():
    with pytest.raises(InvalidInput, match="data folder"):
        Access.opened(Settings(auth="on"), None)


@pytest.mark.parametrize(
    ("headers", "named"),
    [
        ({"Host": "127.0.0.1:8000", "Origin": "https://evil.example"}, "Origin"),
        ({"Host": "127.0.0.1:8000", "Origin": "http://127.0.0.1:9000"}, "Origin"),
        ({"Host": "127.0.0.1:8000", "Origin": "null"}, "Origin"),
        ({"Host": "evil.example:8000", "Origin": "http://evil.example:8000"}, "Host"),
        ({"Host": "evil.example"}, "Host"),
        ({"Host": "127.0.0.1.evil.example"}, "Host"),
    ],
)
def test_a_web_page_cannot_use_the_service_of_the_machine_it_is_shown_on(headers, named):
    access = Access.opened(Settings(), None)
    with pytest.raises(NotAllowed) as refused:
        asyncio.run(access.admit(_scope("127.0.0.1", **headers)))
    assert refused.value.field == named


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "localhost:9000", "[::1]:8000", "rub.localhost", "x"])
def test_the_documentation_of_the_service_can_use_it(host):
    access = Access.opened(Settings(), None)
    asyncio.run(access.admit(_scope("127.0.0.1", Host=host, Origin=f"http://{host}")))


def test_the_document_names_both_headers_and_every_refusal():
    document = service(Settings()).openapi()
    schemes = document["components"]["securitySchemes"]
    assert schemes["bearer"]["scheme"] == "bearer" and schemes["header"]["name"] == "X-API-Key"
    for method, path, needs in GUARDED:
        operation = document["paths"][path][method.lower()]
        assert operation["security"] == [{"bearer": []}, {"header": []}]
        assert {"401", "403", "429"} <= operation["responses"].keys()
        assert needs.value in operation["description"]
    assert "security" not in document["paths"]["/healthz"]["get"]
