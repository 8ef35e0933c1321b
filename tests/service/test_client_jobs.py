"""Both clients hand jobs in once, and follow them through whatever happens to the connection."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Iterator
from typing import Any

import httpx
import pytest

from sdm_core.blade import example_blade
from sdm_core.errors import InvalidInput
from service.client import (
    AsyncClient,
    Client,
    JobNotDone,
    JobStatus,
    Patience,
    ServiceProblem,
    StillUnderWay,
    job_conversations,
    screening_order,
)
from service.client.message import MOST_STREAMS
from service.jobs.job import Fault, Job, State

URL = "http://service.example"
QUICK = Patience(first_s=0.001, attempts=2)
BLADE = example_blade("nasa_rotor_37")


def document(state: State = State.RUNNING, **more: Any) -> dict[str, Any]:
    return Job("a" * 32, "screening", state=state, **{"done": 1, "total": 2} | more).to_dict()


def event(state: State = State.RUNNING, **more: Any) -> bytes:
    return b"event: progress\ndata: " + json.dumps(document(state, **more)).encode() + b"\n\n"


class Stream(httpx.SyncByteStream, httpx.AsyncByteStream):
    """Events, and then its end or an exception."""

    def __init__(self, *parts: bytes | Exception) -> None:
        self.parts = parts

    def __iter__(self) -> Iterator[bytes]:
        for part in self.parts:
            if isinstance(part, Exception):
                raise part
            yield part

    async def __aiter__(self) -> AsyncIterator[bytes]:
        for part in self:
            yield part


def streaming(stream: Stream) -> httpx.Response:
    return httpx.Response(200, headers={"Content-Type": "text/event-stream"}, stream=stream)


class Service:
    """Answers the requests to a path with the next of its answers; the last one for good."""

    def __init__(self, **answers: list[Any]) -> None:
        self.answers, self.asked = answers, []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        self.asked.append(request)
        last = request.url.path.rpartition("/")[2]
        name = last if last in self.answers else "job"
        found = self.answers[name]
        answer = found.pop(0) if len(found) > 1 else found[0]
        if isinstance(answer, Exception):
            raise answer
        if isinstance(answer, dict):
            return httpx.Response(200, json=answer)
        if isinstance(answer, Stream):
            return streaming(answer)
        return httpx.Response(answer.status_code, content=answer.content)

    def count(self, name: str) -> int:
        return sum(request.url.path.endswith(name) for request in self.asked)


def waiting(service: Service, ask: Callable) -> Any:
    with Client(URL, patience=QUICK, http=httpx.Client(transport=httpx.MockTransport(service))) as client:
        return ask(client)


def awaiting(service: Service, ask: Callable) -> Any:
    async def there() -> Any:
        http = httpx.AsyncClient(transport=httpx.MockTransport(service))
        async with AsyncClient(URL, patience=QUICK, http=http) as client:
            return await ask(client)

    return asyncio.run(there())


@pytest.fixture(params=[waiting, awaiting], ids=["sync", "async"])
def ask(request, monkeypatch) -> Callable:
    monkeypatch.setattr(job_conversations, "_AGAIN_S", 0.01)
    monkeypatch.setattr(job_conversations, "_POLL_S", 0.01)
    return request.param


GONE = httpx.ConnectError("refused")
CUT = httpx.RemoteProtocolError("peer closed connection without sending complete message body")


@pytest.mark.parametrize(
    "interruptions",
    [
        {"events": [Stream(event(), CUT), Stream(event(State.DONE))], "job": [document()]},
        {"events": [Stream(event()), Stream(event(State.DONE))], "job": [document()]},
        {"events": [GONE, Stream(event(State.DONE))], "job": [document(), *[GONE] * 9, document()]},
        {"events": [Stream(CUT)], "job": [document(), httpx.Response(503), document(State.DONE)]},
    ],
    ids=["stream cut", "stream ended", "service away for a while", "over when it is back"],
)
def test_a_wait_goes_on_through_every_interruption_to_the_end(ask, interruptions):
    service, seen = Service(**{name: list(answers) for name, answers in interruptions.items()}), []
    done = ask(service, lambda client: client.wait("a" * 32, seen.append))
    assert done.state is State.DONE and isinstance(done, JobStatus)
    assert [status.state for status in seen] == [State.RUNNING, State.DONE]


@pytest.mark.parametrize(
    "nothing",
    [httpx.ReadTimeout("silence"), httpx.Response(404), httpx.Response(200, content=b"<html>hello</html>")],
    ids=["kept by a proxy", "not found", "another page"],
)
def test_a_job_is_asked_for_where_its_events_do_not_come(ask, nothing):
    service = Service(events=[nothing], job=[document(), document(done=2), document(State.DONE, done=2)])
    seen = []
    assert ask(service, lambda client: client.wait("a" * 32, seen.append)).progress.done == 2
    assert service.count("/events") == 1 and [status.progress.done for status in seen] == [1, 2, 2]


def test_a_job_that_failed_says_why_when_it_is_waited_for(ask):
    fault = Fault("model", "abc", "name another")
    service = Service(events=[Stream(event(State.FAILED, fault=fault))], job=[document()])
    with pytest.raises(JobNotDone, match="model = abc: name another") as failed:
        ask(service, lambda client: client.wait("a" * 32))
    assert failed.value.status.fault == fault


def test_a_job_that_was_cancelled_is_not_done(ask):
    service = Service(job=[document(State.CANCELLED)])
    with pytest.raises(JobNotDone, match="cancelled"):
        ask(service, lambda client: client.wait("a" * 32))


def test_a_wait_ends_when_its_time_is_up_and_the_job_goes_on(ask):
    service = Service(events=[Stream(*[event()] * 3)], job=[document()])
    began = time.monotonic()
    with pytest.raises(StillUnderWay, match="1 of 2"):
        ask(service, lambda client: client.wait("a" * 32, timeout_s=0.3))
    assert time.monotonic() - began < 5.0
    assert {request.method for request in service.asked} == {"GET"}


def test_a_wait_for_a_job_that_is_not_there_ends_at_once(ask):
    with pytest.raises(ServiceProblem):
        ask(Service(job=[httpx.Response(404)]), lambda client: client.wait("a" * 32))


def test_a_service_that_stays_away_is_told_after_the_patience(ask, monkeypatch):
    service = Service(job=[GONE])
    patience = Patience(first_s=0.001, attempts=1, total_s=0.2)
    with pytest.raises(ServiceProblem, match="refused"):
        ask(service, lambda client: (setattr(client, "_patience", patience), client.wait("a" * 32))[1])
    assert len(service.asked) > 3


def test_no_more_streams_are_opened_than_leave_room_for_other_requests(monkeypatch):
    monkeypatch.setattr(job_conversations, "_POLL_S", 0.01)
    now = most = 0

    async def service(request: httpx.Request) -> httpx.Response:
        nonlocal now, most
        if not request.url.path.endswith("/events"):
            return httpx.Response(200, json=document())
        now += 1
        most = max(most, now)
        await asyncio.sleep(0.05)
        now -= 1
        return streaming(Stream(event(State.DONE)))

    async def there() -> list[JobStatus]:
        http = httpx.AsyncClient(transport=httpx.MockTransport(service))
        async with AsyncClient(URL, http=http) as client:
            return await asyncio.gather(*(client.wait(f"{i:032x}") for i in range(3 * MOST_STREAMS)))

    assert all(status.state is State.DONE for status in asyncio.run(there()))
    assert most == MOST_STREAMS


def test_an_order_is_sent_again_with_the_key_it_had(ask):
    service = Service(screenings=[GONE, document(State.QUEUED)])
    assert ask(service, lambda client: client.submit_screening(BLADE)).state is State.QUEUED
    first, second = service.asked
    assert first.headers["Idempotency-Key"] == second.headers["Idempotency-Key"]
    assert first.content == second.content
    ask(service, lambda client: client.submit_screening(BLADE))
    assert service.asked[2].headers["Idempotency-Key"] != first.headers["Idempotency-Key"]


def test_the_key_of_an_order_is_the_callers_where_it_has_one(ask):
    service = Service(screenings=[document()], trainings=[document() | {"kind": "training"}])
    ask(service, lambda client: client.submit_screening("nasa_rotor_37", idempotency_key="night 1"))
    ask(service, lambda client: client.submit_training(idempotency_key="sunday"))
    assert [request.headers["Idempotency-Key"] for request in service.asked] == ["night 1", "sunday"]


@pytest.mark.parametrize(
    ("named", "remedy"),
    [
        ("nope", "32 digits"),
        ("", "nasa_rotor_37, generic_compressor_blade"),
        ("nasa_rotor37", "is the example nasa_rotor_37 meant?"),
        ("blade.json", "read_blade(path)"),
        ("blades/first", "client.upload(path)"),
        ("A" * 32, "0-9a-f"),
    ],
)
def test_a_text_that_names_no_blade_is_refused_before_anything_is_sent(ask, named, remedy):
    service = Service(screenings=[document()])
    with pytest.raises(InvalidInput) as refused:
        ask(service, lambda client: client.submit_screening([BLADE, named]))
    assert refused.value.field == "blades[1]" and remedy in refused.value.remedy
    assert service.asked == []


def test_a_retry_whose_answer_is_lost_is_acted_on_once(ask):
    service = Service(retry=[CUT], job=[document(State.FAILED), document(State.QUEUED, attempt=2)])
    assert ask(service, lambda client: client.retry("a" * 32)).attempt == 2
    assert service.count("/retry") == 1


def test_a_retry_that_never_arrived_is_sent_again(ask):
    retried = document(State.QUEUED, attempt=2)
    service = Service(retry=[GONE, retried], job=[document(State.FAILED)])
    assert ask(service, lambda client: client.retry("a" * 32)).attempt == 2
    assert service.count("/retry") == 2


UPLOADED = {"id": "b" * 32, "name": "x", "form": "application/zip", "size_bytes": 1, "sha256": "0"}


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("a.zip", "application/zip"),
        ("a.JSON", "application/json"),
        ("a.ndjson", "application/x-ndjson"),
        ("a.jsonl", "application/x-ndjson"),
    ],
)
def test_a_file_is_streamed_under_the_form_its_name_tells_and_anew_when_it_is_sent_again(
    ask, tmp_path, name, form
):
    content = bytes(range(256)) * 10_000
    (tmp_path / name).write_bytes(content)
    received = []

    def service(request: httpx.Request) -> httpx.Response:
        assert request.headers["Content-Length"] == str(len(content))
        assert "Transfer-Encoding" not in request.headers
        received.append((request.headers["Content-Type"], request.url.params["name"], request.content))
        return httpx.Response(503) if len(received) == 1 else httpx.Response(201, json=UPLOADED)

    def reading(request: httpx.Request) -> httpx.Response:
        request.read()
        return service(request)

    async def reading_async(request: httpx.Request) -> httpx.Response:
        await request.aread()
        return service(request)

    handler = reading if ask is waiting else reading_async
    assert ask(handler, lambda client: client.upload(tmp_path / name)).id == "b" * 32
    assert received == [(form, name, content)] * 2


@pytest.mark.parametrize(
    ("source", "name", "field"),
    [("blades.csv", None, "path"), (b"{}", None, "name"), ("no.zip", None, "path")],
)
def test_what_is_no_file_of_blades_is_not_sent(ask, source, name, field):
    with pytest.raises(InvalidInput) as refused:
        ask(Service(), lambda client: client.upload(source, name))
    assert refused.value.field == field


def test_many_blades_go_ahead_in_parts_in_their_order_and_refusals_name_their_place(ask, monkeypatch):
    monkeypatch.setattr(screening_order, "INLINE_BYTES", 10)
    monkeypatch.setattr(screening_order, "PIECE_BYTES", 45)
    blades = [{"name": "a" * 10}, {"name": "b" * 10}, {"name": "c" * 10}, "nasa_rotor_37", {"name": "d"}]
    refused = {
        "line": "blades-2.ndjson:1.damping_ratio",
        "example": "blades[2].contact",
        "last": "blades-4.ndjson:1",
    }
    places = {"line": "blades[2].damping_ratio", "example": "blades[3].contact", "last": "blades[4]"}
    for which, field in refused.items():
        sent: list[tuple[str, Any]] = []

        def service(request: httpx.Request, field: str = field, sent: list = sent) -> httpx.Response:
            if request.url.path == "/v1/uploads":
                sent.append((request.url.params["name"], request.content.splitlines()))
                return httpx.Response(201, json=UPLOADED | {"id": f"{len(sent):032x}"})
            sent.append(("order", json.loads(request.content)["blades"]))
            problem = {"status": 422, "field": field, "detail": f"{field} = 1: mend it"}
            return httpx.Response(422, json=problem, headers={"Content-Type": "application/problem+json"})

        with pytest.raises(ServiceProblem) as told:
            ask(service, lambda client: client.submit_screening(iter(blades)))
        assert [name for name, _ in sent] == ["blades.ndjson", "blades-2.ndjson", "blades-4.ndjson", "order"]
        assert [len(lines) for _, lines in sent[:3]] == [2, 1, 1]
        uploads = [{"upload": f"{i:032x}"} for i in (1, 2, 3)]
        assert sent[3][1] == [*uploads[:2], {"example": "nasa_rotor_37"}, uploads[2]]
        assert told.value.problem["field"] == places[which]
        assert str(told.value) == f"{places[which]} = 1: mend it"


@pytest.mark.parametrize("blades", [[object()], 5, [{"a": object()}]])
def test_what_is_no_blade_is_refused_by_its_place_before_anything_is_sent(ask, blades):
    service = Service()
    with pytest.raises(InvalidInput, match=r"blades\[0\]"):
        ask(service, lambda client: client.submit_screening(blades))
    assert not service.asked


def test_the_jobs_of_all_pages_are_listed():
    def service(request: httpx.Request) -> httpx.Response:
        after = request.url.params.get("after")
        ids = {None: ["a", "b"], "b": ["c"]}[after]
        following = "/v1/screenings?limit=2&after=b&state=done" if after is None else None
        assert request.url.params["state"] == "done"
        jobs = [document() | {"id": name} for name in ids]
        return httpx.Response(200, json={"jobs": jobs, "next": following})

    assert waiting(service, lambda client: [job.id for job in client.screenings("done")]) == ["a", "b", "c"]

    async def listed(client: AsyncClient) -> list[str]:
        return [job.id async for job in client.screenings(["done"])]

    assert awaiting(service, listed) == ["a", "b", "c"]
