"""Confident answers are held to the exact core in the background; a broken promise raises the alarm."""

from __future__ import annotations

import contextlib
import io
import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path

import httpx
import numpy as np
import pytest
from nearby_models import nearby
from prometheus_client.parser import text_string_to_metric_families

from sdm_core.blade import blade_to_dict, example_blade
from sdm_core.boundary import verdicts
from sdm_core.contact import ContactConfiguration
from service.app import create_app
from service.audit import auditor as auditing
from service.audit.auditor import MOST_WAITING, Auditor
from service.audit.tally import Promise, Tally
from service.operation.logs import _handler, bound
from service.records import audits
from service.records.database import Database, database_url, open_database
from service.rest.model_schemas import ModelAudits
from service.settings import Settings
from training.confident_answers import ConfidentAnswers
from training.contact_class import ARCS, PERMANENT
from training.exact_answers import ExactAnswers
from training.promotion import promote
from training.promotion_check import Remeasured
from training.reference_space import reference_points
from training.registry import load_model

ROTOR, LE = example_blade("nasa_rotor_37"), ContactConfiguration.at("LE")
PROMISE = Promise("m", PERMANENT, 5e-4)


def until(true: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 60.0
    while not true():
        assert time.monotonic() < deadline, what
        time.sleep(0.01)


def metric(http: httpx.Client, name: str, **labels: str) -> float:
    """The sum over the series of a name that have these labels."""
    text = http.get("/metrics").text
    return sum(
        sample.value
        for family in text_string_to_metric_families(text)
        for sample in family.samples
        if sample.name == name and labels.items() <= sample.labels.items()
    )


def questions(count: int, seed: int, contact: str = PERMANENT):
    """Points of the distribution that the certificates are about, as users would send them."""
    for point in reference_points(count, seed, contact):
        yield {
            "blade": blade_to_dict(point.blade()),
            "contact": point.contact().to_dict(),
            "speed_hz": [point.speed_hz],
            "ke": [point.ke],
        }


def settings(folder: Path | None, data: Path | None = None) -> Settings:
    return Settings(models_folder=folder, data_folder=data, models_poll_s=0.01, audit_share_of_time=1.0)


@pytest.fixture
def shifted(tmp_path) -> tuple[Path, str]:
    """A folder whose active model, promoted by force, puts every boundary 40 % too high."""
    folder = tmp_path / "models"
    nearby(folder)
    bad = nearby(folder, 1.4).id
    promote(bad, folder, force=True, check=lambda *models: Remeasured((), {}))
    return folder, bad


def test_a_bad_model_promoted_by_force_raises_the_alarm_within_2000_audited_answers(
    serving, shifted, tmp_path, caplog
):
    folder, bad = shifted
    with (
        serving(create_app(settings(folder, tmp_path / "data"))) as url,
        httpx.Client(base_url=url, timeout=60.0) as http,
    ):
        for question in questions(2_000, seed=41):
            answer = http.post("/v1/stability", json=question)
            assert answer.status_code == 200 and answer.json()["model"] == bad
            alarmed = metric(http, "rubscreen_audit_alarm", model=bad) == 1
            if alarmed:
                break
        assert alarmed
        audited = metric(http, "rubscreen_audit_answers_total")
        wrong = metric(http, "rubscreen_audit_false_stable_total", model=bad, contact=PERMANENT)
        assert audited <= 2_000 and wrong >= 2
        assert metric(http, "rubscreen_audit_evidence", model=bad) >= 100
        told = ModelAudits.model_validate(http.get(f"/v1/models/{bad}/audits").json())
        assert told.auditing and told.alarm and [line.contact for line in told.audits] == [PERMANENT]
        assert told.audits[0].false_stable == wrong and told.audits[0].evidence >= told.alarm_at
        ready = http.get("/readyz")
        # For information: an alarm must not leave the office without any answer.
        assert ready.status_code == 200
        check = ready.json()["checks"]["audit"]
        assert not check["ok"] and not check["needed"] and "0.0005" in check["detail"]
    errors = [r for r in caplog.records if r.name == "rubscreen.audit" and r.levelno == logging.ERROR]
    assert len(errors) == 1 and bad in errors[0].getMessage()
    caplog.clear()  # it is remembered, and said again where the service is started again
    again = settings(folder, tmp_path / "data")
    with serving(create_app(again)) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        assert metric(http, "rubscreen_audit_alarm", model=bad) == 1
        assert not http.get("/readyz").json()["checks"]["audit"]["ok"]
        assert http.get(f"/v1/models/{bad}/audits").json()["audits"][0]["alarmed_at"].endswith("Z")
        promote(nearby(folder).id, folder, force=True, check=lambda *models: Remeasured((), {}))
        # The alarm was about that model; the next one starts with a clean sheet.
        until(lambda: http.get("/readyz").json()["checks"]["audit"]["ok"], "the alarm never went")
        assert metric(http, "rubscreen_audit_alarm") == 0
    assert "ALARM" in caplog.text


@pytest.mark.parametrize("contact", [PERMANENT, ARCS])
def test_the_shipped_model_raises_no_alarm(serving, contact):
    """As many as the bad model needed; of 2,000 each, benchmarks/audit.py."""
    shipped = load_model().id
    with serving(create_app(settings(None))) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        for question in questions(160, seed=43, contact=contact):
            assert http.post("/v1/stability", json=question).json()["model"] == shipped
        answered = metric(http, "rubscreen_answers_total", reason="confident")
        until(lambda: metric(http, "rubscreen_audit_answers_total") == answered, "not all were audited")
        assert metric(http, "rubscreen_audit_passed_over_total") == 0
        assert answered >= 120
        assert metric(http, "rubscreen_audit_alarm") == 0
        assert metric(http, "rubscreen_audit_false_stable_total") == 0


def sample(count: int = 8, ke: float = 5e3, wrong: bool = False, name: str = "m") -> ConfidentAnswers:
    """Answers about rotor 37 at speeds of its range, right or all wrong."""
    speed, at = np.linspace(235.0, 245.0, count), np.full(count, ke)
    right = verdicts(ROTOR, LE, speed, at) == 1.0
    return ConfidentAnswers(ROTOR, LE, speed, at, ~right if wrong else right, name, 5e-4)


@pytest.fixture
def database(tmp_path):
    opened = Database(database_url(None, tmp_path))
    yield opened
    opened.close()


def test_what_is_found_is_counted_by_what_was_answered_and_what_is_true(database, monkeypatch):
    low, high = sample(ke=2e3), sample(ke=4e4)
    assert low.stable.all() and not high.stable.any()
    mistakes: list[ExactAnswers] = []
    lines = io.StringIO()
    monkeypatch.setattr(auditing.logger, "handlers", [_handler("json", lines)])
    auditor = Auditor(1.0, 100, database, mistakes.append)
    for answers in (low, high, sample(5, 2e3, wrong=True)):
        auditor.draw(answers)
    with bound(request_id="r7"):
        auditor.draw(sample(3, 4e4, wrong=True))
    until(lambda: auditor.counted.get(PROMISE, Tally()).audited == 24, "not all were audited")
    auditor.close()
    counted = Tally(answered_stable=11, false_stable=3, answered_unstable=13, false_unstable=5)
    assert auditor.counted == {PROMISE: counted}
    assert audits.read(database)[PROMISE].tally == counted
    # What was found is logged for the request that it was answered in.
    assert lines.getvalue().count('"request_id": "r7"') == 3
    # The surrogate can learn from these more than from any others.
    assert sorted(len(answers) for answers in mistakes) == [3, 5]


def test_replicas_and_restarts_add_up_and_an_alarm_of_one_is_seen_by_all(database):
    first, second = (Auditor(1.0, 100, database) for _ in range(2))
    for auditor in (first, second):
        auditor.draw(sample(6, 4e4, wrong=True))
        auditor.draw(sample(8, 2e3))
    for auditor in (first, second):
        until(lambda a=auditor: a.counted.get(PROMISE, Tally()).audited == 14, "not all were audited")
        auditor.close()
    third = Auditor(1.0, 100, database)
    assert third.known[PROMISE].tally == Tally(answered_stable=28, false_stable=12)
    assert third.alarms("m") == [PROMISE] and third.alarms("another") == []
    third.close()


def test_first_counts_written_at_the_same_moment_are_all_there(database):
    begin = threading.Barrier(4)

    def write() -> None:
        begin.wait()
        for _ in range(10):
            audits.add(database, {PROMISE: Tally(answered_stable=3, undecided=1)})

    writers = [threading.Thread(target=write) for _ in range(4)]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert audits.read(database)[PROMISE].tally == Tally(answered_stable=120, undecided=40)


def test_an_alarm_stays_when_right_answers_follow(database):
    found = audits.add(database, {PROMISE: Tally(answered_stable=10, false_stable=3)})
    assert found[PROMISE].tally.breaks(PROMISE.alpha)
    alarmed = audits.read(database)[PROMISE].alarmed_at
    later = audits.add(database, {PROMISE: Tally(answered_stable=100_000)})
    assert not later[PROMISE].tally.breaks(PROMISE.alpha)
    assert alarmed is not None and audits.read(database)[PROMISE].alarmed_at == alarmed


def test_counts_wait_for_a_database_that_is_away(database, monkeypatch, caplog):
    with monkeypatch.context() as away:
        away.setattr(audits, "add", lambda *asked: (_ for _ in ()).throw(OSError("no route to host")))
        away.setattr(auditing, "WRITE_EVERY_S", 0.01)
        auditor = Auditor(1.0, 100, database)
        auditor.draw(sample(8, 2e3))
        until(lambda: auditor.counted.get(PROMISE, Tally()).audited == 8, "not audited")
        time.sleep(0.1)  # several times of writing
    auditor.close()
    assert audits.read(database)[PROMISE].tally.audited == 8
    assert sum("no route to host" in line for line in caplog.messages) == 1


def test_what_the_exact_core_cannot_decide_counts_for_nothing():
    said = np.array([True, True, False, False, True])
    found = Tally.of(said, np.array([1.0, 0.0, 0.0, 1.0, np.nan]))
    assert found == Tally(2, 1, 2, 1, 1) and found.audited == 5


def test_it_rests_as_long_as_its_share_of_time_asks_for(monkeypatch):
    rested = []
    auditor = Auditor(0.02, 8)
    auditor.close()
    monkeypatch.setattr(auditor._closing, "wait", rested.append)
    auditor._rest(0.010)
    assert rested == [pytest.approx(0.49)]  # 10 ms of 500


def test_more_answers_than_it_has_time_for_are_passed_over_and_counted(monkeypatch):
    began, go_on = threading.Event(), threading.Event()

    def slow(blade, contact, speed, ke, workers):
        began.set()
        assert go_on.wait(60.0)
        return np.full(len(speed), np.nan)

    monkeypatch.setattr(auditing, "verdicts", slow)
    auditor = Auditor(1.0, 1)
    answers = sample(2)
    auditor.draw(answers)
    assert began.wait(30.0)
    for _ in range(MOST_WAITING + 500):
        auditor.draw(answers)
    assert auditor.passed_over == 500
    threading.Timer(0.1, go_on.set).start()
    auditor.close()


def test_an_answer_that_cannot_be_solved_stops_nothing(monkeypatch, caplog):
    def refuse(*asked, workers):
        monkeypatch.undo()
        raise ArithmeticError("singular")

    monkeypatch.setattr(auditing, "verdicts", refuse)
    auditor = Auditor(1.0, 100)
    for _ in range(2):
        auditor.draw(sample(8, 2e3))
    until(lambda: auditor.counted.get(PROMISE, Tally()).audited == 8, "the second was not audited")
    auditor.close()
    assert auditor.passed_over == 8 and "singular" in caplog.text


def test_what_was_audited_before_is_told_where_nothing_is_audited_now(serving, tmp_path):
    shipped = load_model().id
    with contextlib.closing(open_database(tmp_path, None)) as database:
        mine, others = Promise(shipped, PERMANENT, 5e-4), Promise("another", PERMANENT, 5e-4)
        audits.add(database, {mine: Tally(answered_stable=900, undecided=2), others: Tally(7, 7)})
    off = Settings(data_folder=tmp_path, audit_share_of_time=0.0, run_jobs=False)
    with serving(create_app(off)) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        told = http.get(f"/v1/models/{shipped}/audits").json()
        assert not told["auditing"] and not told["alarm"] and len(told["audits"]) == 1
        assert (told["audits"][0]["answered_stable"], told["audits"][0]["undecided"]) == (900, 2)
        assert told["audits"][0]["evidence"] < 1 and told["alarm_at"] == 100
        assert http.get("/v1/models/0123456789abcdef/audits").status_code == 404


def test_probes_are_not_audited(serving):
    with serving(create_app(settings(None))) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        assert http.get("/readyz").json()["checks"]["audit"]["ok"]
        assert http.post("/v1/stability", json=next(questions(1, seed=5))).status_code == 200
        until(lambda: metric(http, "rubscreen_audit_answers_total") == 1, "the answer was not audited")


@pytest.mark.parametrize("off", [{"audit_share_of_time": 0.0}, {"audit_points_per_request": 0}])
def test_nothing_is_audited_where_it_is_turned_off(serving, off):
    with serving(create_app(Settings(**off))) as url, httpx.Client(base_url=url, timeout=60.0) as http:
        http.post("/v1/stability", json=next(questions(1, seed=5)))
        assert "audit" not in http.get("/readyz").json()["checks"]
        assert "rubscreen_audit" not in http.get("/metrics").text
        told = http.get(f"/v1/models/{load_model().id}/audits").json()
        assert (told["auditing"], told["alarm"], told["audits"]) == (False, False, [])
        assert not any(thread.name == "audit" for thread in threading.enumerate())
