"""Both clients ask again when a problem is a passing one, as often and as long as told, and else not."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterator

import httpx
import pytest

from sdm_core.errors import InvalidInput
from service.client import AsyncClient, Client, Patience, ServiceProblem
from service.client.message import Message

QUICK = Patience(first_s=0.001)
READY = httpx.Response(200, json={"models": []})
BUSY = httpx.Response(503)
URL = "http://service.example"


class Service:
    """Answers a request with the next of its answers, or raises it; the last one for good."""

    def __init__(self, *answers: httpx.Response | Exception) -> None:
        self.answers, self.asked = list(answers), []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.asked.append(request)
        answer = self.answers.pop(0) if len(self.answers) > 1 else self.answers[0]
        if isinstance(answer, Exception):
            raise answer
        return httpx.Response(answer.status_code, headers=answer.headers, content=answer.content)


def sync_ask(service: Service, ask: Callable = lambda client: client.models(), **options):
    http = httpx.Client(transport=httpx.MockTransport(service))
    with Client(URL, http=http, **{"patience": QUICK} | options) as client:
        return ask(client)


def async_ask(service: Service, ask: Callable = lambda client: client.models(), **options):
    async def there():
        http = httpx.AsyncClient(transport=httpx.MockTransport(service))
        async with AsyncClient(URL, http=http, **{"patience": QUICK} | options) as client:
            return await ask(client)

    return asyncio.run(there())


@pytest.fixture(params=[sync_ask, async_ask], ids=["sync", "async"])
def ask(request) -> Iterator[Callable]:
    return request.param


PASSING = {
    "too many requests": httpx.Response(429, headers={"Retry-After": "0"}),
    "a busy service": BUSY,
    "a proxy without a service": httpx.Response(502, content=b"<html>"),
    "nobody there": httpx.ConnectError("refused"),
    "a connection cut off": httpx.RemoteProtocolError("disconnected"),
}


@pytest.mark.parametrize("problem", PASSING)
def test_a_passing_problem_is_not_noticed(ask, problem):
    service = Service(PASSING[problem], PASSING[problem], READY)
    assert ask(service) == []
    assert len(service.asked) == 3


@pytest.mark.parametrize("problem", PASSING)
def test_a_problem_that_stays_is_told_after_so_many_attempts(ask, problem):
    service = Service(PASSING[problem])
    with pytest.raises(ServiceProblem):
        ask(service)
    assert len(service.asked) == QUICK.attempts


@pytest.mark.parametrize("answer", [httpx.Response(422), httpx.Response(500), httpx.ReadTimeout("slow")])
def test_what_will_not_pass_is_asked_once(ask, answer):
    service = Service(answer, READY)
    with pytest.raises(ServiceProblem):
        ask(service)
    assert len(service.asked) == 1


def test_the_service_is_left_alone_for_as_long_as_it_says(ask):
    service, began = Service(httpx.Response(429, headers={"Retry-After": "1"}), READY), time.monotonic()
    assert ask(service) == []
    assert time.monotonic() - began >= 1.0


def test_a_wait_beyond_the_total_time_is_not_begun(ask):
    service, began = Service(httpx.Response(503, headers={"Retry-After": "3600"}), READY), time.monotonic()
    with pytest.raises(ServiceProblem) as told:
        ask(service, patience=Patience(total_s=5.0))
    assert told.value.retry_after_s == 3600.0 and time.monotonic() - began < 5.0


def test_a_date_in_retry_after_is_left_to_the_back_off(ask):
    service = Service(httpx.Response(503, headers={"Retry-After": "Wed, 21 Oct 2065 07:28:00 GMT"}), READY)
    assert ask(service) == []


def test_no_part_of_a_question_is_sent_when_the_time_is_up(ask):
    service = Service(READY)
    with pytest.raises(ServiceProblem, match="within"):
        ask(service, patience=Patience(total_s=0.0))
    assert not service.asked


def test_a_rollback_is_never_sent_twice(ask):
    service = Service(httpx.RemoteProtocolError("disconnected"), READY)
    with pytest.raises(ServiceProblem):
        ask(service, lambda client: client.rollback())
    assert len(service.asked) == 1


def test_whether_it_is_ready_is_about_now(ask):
    service = Service(BUSY, READY)
    assert ask(service, lambda client: client.ready()) is False
    assert len(service.asked) == 1


def test_an_order_keeps_its_idempotency_key_however_often_it_is_sent(ask):
    def order():
        reply = yield Message.order("/v1/screenings", {"blades": []})
        return reply.status_code

    service = Service(BUSY, BUSY, READY)
    assert ask(service, lambda client: client.run(order())) == 200
    keys = {request.headers["idempotency-key"] for request in service.asked}
    assert len(service.asked) == 3 and len(keys) == 1
    assert ask(service, lambda client: client.run(order())) == 200
    assert service.asked[-1].headers["idempotency-key"] not in keys


def test_the_key_is_sent_from_the_argument_or_the_environment(ask, monkeypatch):
    service = Service(READY)
    ask(service)
    assert "authorization" not in service.asked[-1].headers
    monkeypatch.setenv("RUBSCREEN_API_KEY", "rub_1_env\n")
    ask(service)
    assert service.asked[-1].headers["authorization"] == "Bearer rub_1_env"
    ask(service, key="rub_2_given")
    assert service.asked[-1].headers["authorization"] == "Bearer rub_2_given"


@pytest.mark.parametrize("key", ["rub_1_sécret", "rub_1\nX-Evil: 1"])
def test_a_key_that_no_header_can_carry_is_refused_without_being_told(ask, key):
    with pytest.raises(InvalidInput) as refused:
        ask(Service(READY), key=key)
    assert "rub_1" not in str(refused.value)


def test_a_key_is_in_no_error_and_no_representation(ask):
    with pytest.raises(ServiceProblem) as told:
        ask(Service(httpx.ConnectError("refused")), key="rub_1_secret", patience=Patience(attempts=1))
    assert "secret" not in str(told.value) and "secret" not in repr(told.value.problem)
    assert "secret" not in repr(Client(URL, key="rub_1_secret")._address)


def test_a_problem_that_is_no_object_is_another_services(ask):
    content = httpx.Response(422, headers={"content-type": "application/problem+json"}, content=b"[]")
    with pytest.raises(ServiceProblem, match="not from rubscreen"):
        ask(Service(content))
