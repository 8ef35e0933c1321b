"""Done by the calendar: never lost, whatever ends in between, and done once each time."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from sqlalchemy.exc import OperationalError

from sdm_core.errors import InvalidInput
from service.jobs.calendar import Calendar
from service.jobs.errors import NoRoom
from service.jobs.job import SCREENING, TRAINING, Job, State
from service.jobs.job_folder import JobFolder
from service.jobs.jobs import Jobs, JobSettings
from service.jobs.training.request import TrainingRequest
from service.records.database import Database
from service.records.schedules import ScheduleRecords
from service.rest.accepting import train_when_due

SUNDAYS = ("0 3 * * SUN", "Europe/Paris")
CONTEXT = {"training": TrainingRequest(seed=0).to_dict(), "owner": "k1", "owner_name": "tool"}
PUT_AT = datetime(2026, 3, 24, 12, 0, 30, tzinfo=UTC)  # a Tuesday; clocks go forward on Sunday, 29 March
# At three in Paris on Sundays from then on, in UTC.
TIMES = [datetime(2026, 3, 29, 1, tzinfo=UTC), *(datetime(2026, 4, day, 1, tzinfo=UTC) for day in (5, 12))]


class Ticks:
    """Notes what it was called with; fails as often as it is told."""

    def __init__(self, failures: int = 0) -> None:
        self.called: list[datetime] = []
        self.failures = failures

    def __call__(self, at: str, context: dict[str, Any]) -> None:
        if self.failures:
            self.failures -= 1
            raise OperationalError("insert", {}, Exception("database is locked"))
        assert context == CONTEXT
        self.called.append(datetime.fromisoformat(at))


class Waiting:
    """Trains nothing, until it is cancelled."""

    def run(self, folder: JobFolder, control: Any) -> None:
        control.sleep(600.0)


@contextmanager
def handing_in(database: Database, folder: Path) -> Iterator[Jobs]:
    """Jobs that take the trainings of the schedule, and run none."""
    kinds = {SCREENING: Waiting(), TRAINING: Waiting()}
    jobs = Jobs(database, folder, kinds, JobSettings({}, reserve_bytes=0), train_when_due)
    try:
        yield jobs
    finally:
        jobs.close()


def by_hand(jobs: Jobs) -> Calendar:
    """The calendar of jobs, looked at by the test and no longer by the thread that tends them."""
    calendar, jobs.calendar = jobs.calendar, SimpleNamespace(look=lambda: None)  # type: ignore[assignment]
    return calendar


def trainings(jobs: Jobs) -> list[Job]:
    return jobs.records.page(TRAINING)


def test_what_is_due_is_done_once_at_its_time_on_the_clocks_of_its_zone(database):
    ticks = Ticks()
    calendar = Calendar(database, ticks)
    calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
    calendar.look(PUT_AT)
    calendar.look(TIMES[0] - timedelta(seconds=1))
    assert ticks.called == []
    for now in (TIMES[0], TIMES[0] + timedelta(seconds=5), TIMES[1] - timedelta(seconds=1), TIMES[1]):
        calendar.look(now)
    assert ticks.called == TIMES[:2]
    assert [at.hour for at in ticks.called] == [3, 3]


def test_of_times_missed_while_nobody_looked_the_last_is_made_up_for(database):
    ticks = Ticks()
    calendar = Calendar(database, ticks)
    calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
    for _ in range(2):
        calendar.look(TIMES[2] + timedelta(days=3))
    assert ticks.called == TIMES[2:]


def test_what_failed_is_tried_again_until_it_is_done(database):
    ticks = Ticks(failures=3)
    calendar = Calendar(database, ticks)
    calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
    for seconds in (5, 10, 15):
        with pytest.raises(OperationalError):
            calendar.look(TIMES[0] + timedelta(seconds=seconds))
    for seconds in (20, 25):
        calendar.look(TIMES[0] + timedelta(seconds=seconds))
    assert ticks.called == TIMES[:1]


def test_a_schedule_that_is_replaced_is_there_at_every_moment(database):
    calendar, replacing = Calendar(database, Ticks()), threading.Event()
    calendar.schedule(*SUNDAYS, CONTEXT)
    seen = []

    def look() -> None:
        while not replacing.is_set():
            seen.append(calendar.scheduled())

    reader = threading.Thread(target=look)
    reader.start()
    for i in range(60):
        calendar.schedule(f"{i} 3 * * *", "UTC", CONTEXT)
    replacing.set()
    reader.join()
    assert len(seen) > 10 and None not in seen
    assert calendar.scheduled().cron == "59 3 * * *"


def test_a_schedule_that_is_no_good_leaves_the_one_there_is(database):
    calendar = Calendar(database, Ticks())
    calendar.schedule(*SUNDAYS, CONTEXT)
    for cron, timezone in (
        ("daily", "UTC"),
        ("* * * * * *", "UTC"),
        ("0 3 30 2 *", "UTC"),
        ("0 3 * * \x00", "UTC"),
        ("0 3 * * *", "Mars/Olympus"),
        ("0 3 * * *", "\x00"),
    ):
        with pytest.raises(InvalidInput):
            calendar.schedule(cron, timezone, CONTEXT)
    found = calendar.scheduled()
    assert (found.cron, found.timezone, found.context) == (*SUNDAYS, CONTEXT)
    assert (found.coming.isoweekday(), found.coming.hour, found.coming.minute) == (7, 3, 0)
    calendar.unschedule()
    assert calendar.scheduled() is None
    calendar.look()


def test_what_is_replaced_while_it_is_done_is_not_noted_as_done_of_the_other(database):
    records = ScheduleRecords(database)
    calendar = Calendar(
        database, lambda at, context: calendar.schedule("0 4 * * *", "UTC", {}, done_to=PUT_AT)
    )
    calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
    calendar.look(TIMES[0])
    assert records.get("training").done_to == PUT_AT


def test_a_training_is_handed_in_once_though_the_process_ended_before_it_was_noted(
    database, tmp_path, monkeypatch
):
    with handing_in(database, tmp_path) as jobs:
        calendar = by_hand(jobs)
        calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
        with monkeypatch.context() as ending:
            ending.setattr(ScheduleRecords, "done", lambda *a: (_ for _ in ()).throw(KeyboardInterrupt))
            with pytest.raises(KeyboardInterrupt):
                calendar.look(TIMES[0])
        (handed_in,) = trainings(jobs)
        assert handed_in.name == "scheduled 2026-03-29T03:00:00+02:00"
        jobs.records.update(handed_in.id, state=State.DONE, finished_at=datetime.now(UTC))
        calendar.look(TIMES[0])
        assert [job.id for job in trainings(jobs)] == [handed_in.id]
        request = TrainingRequest.from_dict(jobs.folders.of(handed_in.id).request())
        assert (handed_in.owner, request.seed > 0) == ("k1", True)


def test_a_training_for_which_there_is_no_room_is_handed_in_when_there_is(database, tmp_path, monkeypatch):
    with handing_in(database, tmp_path) as jobs:
        calendar = by_hand(jobs)
        calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
        with monkeypatch.context() as full:

            def no_room(*asked: Any) -> None:
                raise NoRoom("data_folder", "full", "make room")

            full.setattr("service.jobs.jobs.check_room", no_room)
            with pytest.raises(NoRoom):
                calendar.look(TIMES[0])
            assert trainings(jobs) == []
        calendar.look(TIMES[0])
        assert len(trainings(jobs)) == 1


def test_a_training_that_is_due_while_one_is_under_way_is_left_out(database, tmp_path):
    with handing_in(database, tmp_path) as jobs:
        calendar = by_hand(jobs)
        calendar.schedule(*SUNDAYS, CONTEXT, done_to=PUT_AT)
        for now in TIMES:
            calendar.look(now)
        assert len(trainings(jobs)) == 1


def test_the_schedule_is_kept_over_a_restart_and_done_by_the_running_service(database, tmp_path):
    with handing_in(database, tmp_path) as jobs:
        jobs.calendar.schedule(*SUNDAYS, CONTEXT)
    with handing_in(database, tmp_path) as jobs:
        assert jobs.calendar.scheduled().cron == SUNDAYS[0]
        jobs.calendar.schedule("* * * * *", "UTC", CONTEXT, done_to=PUT_AT)
    with handing_in(database, tmp_path) as jobs:  # at its start it finds a time that was missed
        for _ in range(200):
            if trainings(jobs):
                break
            threading.Event().wait(0.05)
        assert len(trainings(jobs)) == 1


def test_a_schedule_that_an_older_version_made_is_taken_over(database, tmp_path):
    with handing_in(database, tmp_path):
        from dbos import DBOS

        DBOS.create_schedule(
            schedule_name="training",
            workflow_fn=_registered_due(),
            schedule=SUNDAYS[0],
            context=CONTEXT,
            automatic_backfill=True,
            cron_timezone=SUNDAYS[1],
        )
    for _ in range(2):
        with handing_in(database, tmp_path) as jobs:
            found = jobs.calendar.scheduled()
            assert (found.cron, found.timezone, found.context) == (*SUNDAYS, CONTEXT)
            assert jobs.queue.former_schedule() is None


def _registered_due() -> Any:
    from dbos._dbos import _get_dbos_instance

    return _get_dbos_instance()._registry.workflow_info_map["due"]
