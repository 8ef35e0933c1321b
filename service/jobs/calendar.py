"""What is done by the calendar: looked at every few seconds, by every replica, and done once each time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

from croniter import CroniterError, croniter

from sdm_core.errors import InvalidInput
from service.records.database import Database
from service.records.schedules import KeptSchedule, ScheduleRecords

_TRAINING = "training"

Tick = Callable[[str, dict[str, Any]], None]


@dataclass(frozen=True)
class Schedule:
    """When something is done again.

    Attributes
    ----------
    cron, timezone
        Five fields, and the time zone they are in.
    coming
        The next time.
    context
        What it is done with.
    """

    cron: str
    timezone: str
    coming: datetime
    context: dict[str, Any]


class Calendar:
    """The one schedule there may be: its row in the database, and nothing else, says what is due.

    A time is noted as dealt with after `tick` returned, so one whose `tick` failed, or whose process ended
    meanwhile, is tried again, and by whichever replica looks next. Of times missed while no process ran the
    last one is made up for.

    Parameters
    ----------
    tick
        Called with the time (ISO 8601) and the context of the schedule when it is due. It may be called for
        one time by several replicas, and again after it failed: doing it once is its own business.
    """

    def __init__(self, database: Database, tick: Tick) -> None:
        self._records, self._tick = ScheduleRecords(database), tick

    def schedule(
        self, cron: str, timezone: str, context: dict[str, Any], done_to: datetime | None = None
    ) -> None:
        """Be called again and again, in place of the schedule there was.

        Parameters
        ----------
        done_to
            Times up to this one are not due; None is now.

        Raises
        ------
        InvalidInput
            When `cron` has not five fields that mean something, or there is no such time zone.
        """
        if len(cron.split()) != 5 or not croniter.is_valid(cron) or not _comes(cron):
            raise InvalidInput("cron", cron, 'give five fields, e.g. "0 3 * * SUN" for Sundays at three')
        try:
            ZoneInfo(timezone)
        except (ValueError, OSError, LookupError):
            raise InvalidInput("timezone", timezone, 'give an IANA name, e.g. "Europe/Paris"') from None
        since = datetime.now(UTC) if done_to is None else done_to
        self._records.put(_TRAINING, KeptSchedule(cron, timezone, context, since))

    def scheduled(self) -> Schedule | None:
        """The schedule there is."""
        kept = self._records.get(_TRAINING)
        if kept is None:
            return None
        coming = croniter(kept.cron, datetime.now(ZoneInfo(kept.timezone))).get_next(datetime)
        return Schedule(kept.cron, kept.timezone, coming, kept.context)

    def unschedule(self) -> None:
        """Have no schedule any more."""
        self._records.remove(_TRAINING)

    def look(self, now: datetime | None = None) -> None:
        """Call `tick` when a time has come; raises what it raises, and tries it again at the next look."""
        kept = self._records.get(_TRAINING)
        if kept is None:
            return
        due = _last_time(kept, now or datetime.now(UTC))
        if due > kept.done_to:
            self._tick(due.isoformat(), kept.context)
            self._records.done(_TRAINING, kept, due)


def _last_time(kept: KeptSchedule, now: datetime) -> datetime:
    """The last time of a schedule up to now."""
    minute = now.astimezone(ZoneInfo(kept.timezone)).replace(second=0, microsecond=0)
    # A second later, since the time it begins at does not count; a cron's times are whole minutes.
    return croniter(kept.cron, minute + timedelta(seconds=1)).get_prev(datetime)


def _comes(cron: str) -> bool:
    """Whether there is such a time: the 30th of February is none."""
    try:
        croniter(cron, datetime.now(UTC)).get_next(datetime)
    except (CroniterError, ValueError):
        return False
    return True
