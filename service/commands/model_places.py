"""Where models are promoted: in a folder of this machine, or in that of a running service."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from service.client import Client, ServiceProblem
from training import activation, promotion
from training.activation import Activation
from training.promotion import Promotion, PromotionRefused

REFUSED = "urn:rubscreen:problem:promotion-refused"


class ModelPlace(Protocol):
    """A models folder, near or far; `name` is what a user calls it."""

    @property
    def name(self) -> str: ...

    def promote(self, model_id: str, *, force: bool) -> Promotion:
        """As `training.promotion.promote`."""
        ...

    def rollback(self) -> Promotion:
        """As `training.promotion.rollback`."""
        ...

    def history(self) -> tuple[Activation, ...]:
        """As `training.activation.history`."""
        ...


@dataclass(frozen=True)
class Folder:
    """A folder of this machine."""

    path: Path

    @property
    def name(self) -> str:
        """Its path."""
        return str(self.path)

    def promote(self, model_id: str, *, force: bool) -> Promotion:
        """Here."""
        return promotion.promote(model_id, self.path, force=force)

    def rollback(self) -> Promotion:
        """Here."""
        return promotion.rollback(self.path)

    def history(self) -> tuple[Activation, ...]:
        """Here."""
        return activation.history(self.path)


@dataclass(frozen=True)
class Service:
    """The folder of a running service."""

    name: str

    def promote(self, model_id: str, *, force: bool) -> Promotion:
        """There.

        Raises
        ------
        PromotionRefused
            With the reasons of the service's gate.
        ServiceProblem
            For everything else.
        """
        try:
            with Client(self.name) as client:
                made = client.promote(model_id, force=force)
        except ServiceProblem as error:
            if error.problem.get("type") == REFUSED:
                raise PromotionRefused(model_id, tuple(error.problem.get("reasons", ()))) from None
            raise
        return Promotion(made.model, made.was, tuple(made.overridden))

    def rollback(self) -> Promotion:
        """There."""
        with Client(self.name) as client:
            made = client.rollback()
        return Promotion(made.model, made.was)

    def history(self) -> tuple[Activation, ...]:
        """There."""
        with Client(self.name) as client:
            changes = client.model_history().changes
        return tuple(
            Activation(**(change.model_dump() | {"reasons": tuple(change.reasons)})) for change in changes
        )


def place_of(url: str | None, folder: Path | None) -> ModelPlace:
    """The service at an address, or a folder."""
    if url is not None:
        return Service(url)
    assert folder is not None
    return Folder(folder)
