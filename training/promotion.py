"""Promotion and rollback: which model answers, and why another does not (decision 14)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from sdm_core.errors import InvalidInput, RubscreenError
from training import promotion_check
from training.activation import FIRST, PROMOTED, ROLLED_BACK, activate, active_id, before_active
from training.promotion_check import Remeasured
from training.promotion_gate import worse_in_words
from training.registry import SHIPPED, Model, load_model

Check = Callable[[Model, Model | None], Remeasured]
"""Measures a candidate anew, beside the active model where there is one."""


class PromotionRefused(RubscreenError):
    """The candidate is worse than the active model, or not what its card says.

    Parameters
    ----------
    model
        The candidate.
    reasons
        In words, one each.
    """

    def __init__(self, model: str, reasons: tuple[str, ...]) -> None:
        self.model, self.reasons = model, reasons
        super().__init__(f"{model} is not promoted: {'; '.join(reasons)}")

    def __reduce__(self):
        return type(self), (self.model, self.reasons)


@dataclass(frozen=True)
class Promotion:
    """A change of the active model.

    Attributes
    ----------
    model, was
        Active from now on, and before; the same where nothing had to change.
    overridden
        What the gate said against it, when it was forced.
    """

    model: str
    was: str | None
    overridden: tuple[str, ...] = ()


def promote(
    model_id: str, folder: Path = SHIPPED, *, force: bool = False, check: Check | None = None
) -> Promotion:
    """Make a model the active one of its folder, unless it is worse than what is active now.

    The first model of a folder is activated without comparison. Where the active model cannot be loaded,
    the candidate is held against its own card alone.

    Parameters
    ----------
    force
        Promote it whatever the gate says, which the history then records. A damaged model is not
        promoted by force either.
    check
        In place of the measurement on fresh points (`training.promotion_check`).

    Raises
    ------
    PromotionRefused
        With every reason.
    InvalidInput, DamagedFile
        As `load_model` of the candidate; or when the folder cannot be written, or changed meanwhile.
    """
    candidate = load_model(model_id, folder)
    now = _active(folder)
    if now is None:
        activate(candidate.id, folder, FIRST, expected=None)
        return Promotion(candidate.id, None)
    if now == candidate.id:
        return Promotion(candidate.id, now)
    try:
        active = load_model(now, folder)
    except InvalidInput:
        active = None
    found = (check or promotion_check.remeasured)(candidate, active)
    reasons = (*worse_in_words(candidate, active), *found.reasons)
    if reasons and not force:
        raise PromotionRefused(candidate.id, reasons)
    activate(
        candidate.id,
        folder,
        PROMOTED,
        expected=now,
        forced=force,
        reasons=reasons,
        measured=found.figures,
    )
    return Promotion(candidate.id, now, reasons)


def promote_unless_worse(model_id: str, folder: Path, check: Check | None = None) -> tuple[str, ...]:
    """As `promote`; the reasons where it is refused, empty where the model is active now."""
    try:
        promote(model_id, folder, check=check)
    except PromotionRefused as refused:
        return refused.reasons
    return ()


def rollback(folder: Path = SHIPPED) -> Promotion:
    """Make the model active again that was before the active one; no gate, it was through it once.

    Again, it returns to the one before that.

    Raises
    ------
    InvalidInput, DamagedFile
        When the history knows no earlier model, or that model is gone or damaged.
    """
    now, before = _active(folder), before_active(folder)
    if before is None:
        raise InvalidInput("models folder", str(folder), "promote a model: none was active before this one")
    activate(load_model(before, folder).id, folder, ROLLED_BACK, expected=now)
    return Promotion(before, now)


def _active(folder: Path) -> str | None:
    try:
        return active_id(folder)
    except InvalidInput:
        return None
