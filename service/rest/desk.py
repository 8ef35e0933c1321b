"""What the running service holds: its settings, its screener and what is wrong with it, its workers."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from anyio import CapacityLimiter, to_thread

from sdm_core.blade import Blade, ModalState
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import InvalidInput
from service.answerer import Answerer
from service.rest.errors import NotReady
from service.rest.limits import WorkQueue
from service.settings import Settings
from training.answers import PointAnswers
from training.registry import SHIPPED, ModelEntry, list_models
from training.screening import Screener

logger = logging.getLogger("rubscreen.service")

# One mode: the smallest destabilising K_e is 2ξ(1 + ξ)ω² = 790 N/m. The first point lies below it, the
# second deep inside a lobe.
_PROBE = Blade("self-check", ("TIP",), 1e-3, [ModalState(0.0, np.array([100.0]), np.array([[1.0]]))])
_PROBE_CONTACT = ContactConfiguration.at("TIP")
_PROBE_SPEED_HZ, _PROBE_KE = np.array([40.0, 40.0]), np.array([400.0, 40000.0])
_PROBE_STABLE = [1.0, 0.0]


@dataclass(frozen=True)
class Desk:
    """The state of the service from start to stop.

    Attributes
    ----------
    screener
        What answers.
    fault
        Why there is no surrogate; None when there is one.
    work
        Where answers are computed.
    """

    settings: Settings
    screener: Answerer
    fault: InvalidInput | None
    work: WorkQueue
    _checking: CapacityLimiter

    @classmethod
    def opened(cls, settings: Settings, screener: Answerer | None = None) -> Desk:
        """The desk with `screener`, or with the active model; a damaged one leaves the exact core."""
        fault = None
        if screener is None:
            try:
                screener = Screener.default(_folder(settings))
            except InvalidInput as error:
                logger.error("no surrogate: %s", error)
                screener, fault = Screener(None), error
        work = WorkQueue(settings.worker_threads, settings.max_waiting, settings.deadline_s)
        return cls(settings, screener, fault, work, CapacityLimiter(1))

    def models(self) -> list[ModelEntry]:
        """The models of the registry, the one that answers marked and first."""
        # Not the registry's own mark, which may have moved since this service started.
        answering = self.answering
        entries = [
            replace(entry, active=entry.id == answering) for entry in list_models(_folder(self.settings))
        ]
        return sorted(entries, key=lambda entry: (not entry.active, entry.id))

    @property
    def answering(self) -> str | None:
        """Identifier of the model that answers."""
        return getattr(self.screener, "model_id", None)

    def answerer(self, policy: str) -> Answerer:
        """What answers under `policy`.

        Raises
        ------
        NotReady
            When the surrogate is needed and there is none. Under `auto` too: the exact core alone
            is right but a thousand times slower, which a client should choose, not run into.
        """
        if self.fault is not None and policy != "exact":
            remedy = f'{self.fault.remedy}; until then policy "exact" answers'
            raise NotReady(self.fault.field, self.fault.value, remedy)
        return self.screener

    async def check(self) -> PointAnswers:
        """The service's answer to a question with a known answer.

        Not in the queue of work, so that a busy service still counts as ready.

        Raises
        ------
        NotReady
            When there is no surrogate, or the answer is not the known one.
        """
        answerer = self.answerer("auto")

        def ask(policy: str) -> PointAnswers:
            return answerer.points(_PROBE, _PROBE_CONTACT, _PROBE_SPEED_HZ, _PROBE_KE, policy)

        for policy in ("exact", "auto"):
            found = await to_thread.run_sync(ask, policy, limiter=self._checking)
            if found.stable.tolist() != _PROBE_STABLE:
                remedy = f"it must be {_PROBE_STABLE}: install the service again"
                raise NotReady("self_check", f"{found.stable.tolist()} under {policy}", remedy)
        return found


def _folder(settings: Settings) -> Path:
    return settings.models_folder or SHIPPED
