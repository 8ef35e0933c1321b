"""How many jobs a key, and all together, may have waiting or running."""

from __future__ import annotations

from dataclasses import dataclass

from service.rest.access import Caller
from service.rest.rate_limits import TooManyRequests

# Jobs take minutes to hours: sooner, it is hardly worth asking again.
_RETRY_AFTER_S = 60


class TooManyJobs(TooManyRequests):
    """No further job is taken on."""


@dataclass(frozen=True)
class JobQuota:
    """What the service takes on.

    Attributes
    ----------
    max_active_jobs
        Jobs of one key that wait or run, unless the key has a number of its own.
    max_queued_jobs
        Jobs of everybody that wait or run.

    Examples
    --------
    >>> from service.rest.access import ANONYMOUS
    >>> JobQuota(max_active_jobs=2, max_queued_jobs=3).check_job_quota(ANONYMOUS, 2, 2)
    """

    max_active_jobs: int
    max_queued_jobs: int

    def check_job_quota(self, caller: Caller, active_of_owner: int, active_of_all: int) -> None:
        """Refuse a job too many; who needs no key has no quota of its own.

        Parameters
        ----------
        active_of_owner, active_of_all
            Jobs that wait or run already.

        Raises
        ------
        TooManyJobs
            When there are as many as there may be.
        """
        most = self.max_active_jobs if caller.max_active_jobs is None else caller.max_active_jobs
        if caller.key_id is not None and active_of_owner >= most:
            found = f"{active_of_owner} of key {caller.key_id} ({caller.name}) wait or run"
            remedy = f"wait until one of at most {most} ends, or cancel one"
            raise TooManyJobs("jobs", found, remedy, _RETRY_AFTER_S)
        if active_of_all >= self.max_queued_jobs:
            found = f"{active_of_all} of all callers wait or run"
            remedy = f"send it again later: the service takes on {self.max_queued_jobs}"
            raise TooManyJobs("jobs", found, remedy, _RETRY_AFTER_S)
