"""Whether this service should be sent requests, from checks that probes cannot load it with."""

from __future__ import annotations

from anyio import CapacityLimiter, to_thread

from service.operation.draining import Draining
from service.operation.readiness import Check, KeptCheck, database_check, folder_check
from service.rest.active_model import Answering
from service.rest.desk import Desk
from service.rest.errors import Leaving, NotReady
from service.rest.self_check import self_check


class Readiness:
    """What ``/readyz`` asks.

    Whether there is a model, and whether the service is about to stop, is looked up each time; what takes
    work is done at most once a second: the self-check of a model, the database, the disk.

    Attributes
    ----------
    solver
        The exact method, once a check has asked it.
    """

    def __init__(self, desk: Desk, draining: Draining) -> None:
        self._desk, self._draining = desk, draining
        self._limiter = CapacityLimiter(1)
        self._of_model: tuple[Answering, KeptCheck] | None = None
        self._others: dict[str, KeptCheck] = {}
        # The disk first: where it is full, the database does not answer either, and is not what to mend.
        if (folder := desk.settings.data_folder) is not None:
            self._others["disk"] = KeptCheck(folder_check(folder, desk.settings.min_free_bytes))
        if desk.database is not None:
            self._others["database"] = KeptCheck(database_check(desk.database))
        self.solver = ""

    async def checks(self) -> dict[str, Check]:
        """Every check, when the service is ready.

        Raises
        ------
        Leaving
            When it is about to stop.
        NotReady
            When there is no surrogate, its answer or the exact core's is not the known one, the database does
            not answer, or there is no room on the disk.
        """
        if self._draining.begun:
            raise Leaving(
                "service", "draining", "send requests to another replica: this one is about to stop"
            )
        found = {"self_check": await self._model_check(self._desk.answering_now("auto"))()}
        for name, check in self._others.items():
            found[name] = await check()
        for name, outcome in found.items():
            if not outcome.ok:
                raise NotReady(name, outcome.detail, outcome.remedy)
        if self._desk.auditor is not None:
            found["audit"] = self._audit()
        return found

    def _model_check(self, now: Answering) -> KeptCheck:
        """The self-check of what answers now; another model is asked anew, not in a second."""
        if self._of_model is None or self._of_model[0] is not now:

            async def check() -> Check:
                return await to_thread.run_sync(self._self_check, now, limiter=self._limiter)

            self._of_model = now, KeptCheck(check)
        return self._of_model[1]

    def _self_check(self, now: Answering) -> Check:
        try:
            # In no queue of work: a busy service still counts as ready.
            for policy in ("exact", "auto"):
                self.solver = self_check(now.unobserved, policy).solver
        except NotReady as error:
            return Check(False, error.value, remedy=error.remedy)
        return Check(True, "surrogate and exact core gave a known answer")

    def _audit(self) -> Check:
        """For information: taking every replica out of service would leave nobody to answer exactly."""
        assert self._desk.auditor is not None
        broken = self._desk.auditor.alarms(self._desk.answering)
        if broken:
            rates = ", ".join(f"{promise.alpha:g} in {promise.contact} contact" for promise in broken)
            remedy = "promote another model, or ask with policy exact"
            return Check(False, f"the certified rate was contradicted: {rates}", needed=False, remedy=remedy)
        tallies = [
            seen.tally for p, seen in self._desk.auditor.known.items() if p.model == self._desk.answering
        ]
        audited, wrong = sum(t.audited for t in tallies), sum(t.false_stable for t in tallies)
        return Check(True, f"{wrong} false stable among {audited} audited answers", needed=False)
