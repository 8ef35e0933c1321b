"""Campbell diagram, lobes and needed damping on the wire."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel, Field

from sdm_core.assessment.campbell import CampbellDiagram
from sdm_core.assessment.mode_lobes import LobeOwner
from sdm_core.assessment.needed_damping import NeededDamping
from sdm_core.assessment.plain_data import plain
from sdm_core.assessment.unstable_speeds import SpeedInterval
from service.rest.assessment_questions import LobesQuestion

Json = dict[str, Any]


class CrossingReply(BaseModel):
    """A rotor speed at which an engine order excites a mode."""

    order: int
    mode: int = Field(description="From 1.")
    speed_hz: float
    frequency_hz: float


class CampbellReply(BaseModel):
    """Natural frequencies over rotor speed, and where engine orders meet them."""

    speed_hz: list[float]
    frequency_hz: list[list[float]] = Field(description="A row a speed, a column a mode.")
    engine_orders: list[int]
    crossings: list[CrossingReply] = Field(description="By rising speed.")


class TipReply(BaseModel):
    """Tip of a lobe: the least K_e of its neighbourhood, by the exact core."""

    ke: float = Field(description="N/m.")
    speed_hz: float
    speed_rpm: float
    speed_ratio: float = Field(description="Over the first frequency at rest.")
    chatter_hz: float
    lobes_per_revolution: float
    error_estimate: float | None = Field(description="Relative; null where it is not proven.")


class LobeReply(BaseModel):
    """A lobe, and the mode that owns it."""

    tip: TipReply
    mode: int = Field(description="With the natural frequency nearest the chatter frequency; from 1.")
    frequency_hz: float = Field(description="That mode's, at the tip's speed.")
    participation: list[float] = Field(
        description="Share of every mode in 1/K_e, adding up to 1; empty where contact is not permanent."
    )
    ke_without: float | None = Field(
        description="First crossing at the same speed without that mode; null where none below ke_max."
    )


class LobesReply(BaseModel):
    """The deepest lobes, the smallest K_e first."""

    speed_range_hz: list[float]
    ke_max: float
    lobes: list[LobeReply]
    unstable_speeds_hz: list[list[float]] | None = Field(
        description="Rotor speeds at which ke_liner destabilises, edges exact; null without it."
    )
    unstable_share: float | None = Field(description="Their share of the range; null without ke_liner.")
    proven: bool | None = Field(description="Whether every point they rest on is; null without ke_liner.")


class DampingReply(BaseModel):
    """The damping with which no lobe comes below a stiffness."""

    ke: float = Field(description="To be met, N/m.")
    factor: float = Field(description="On every damping ratio; below 1 where some may be lost.")
    damping_ratio: list[float] = Field(description="The blade's, times the factor.")
    worst: TipReply | None = Field(description="Deepest lobe then.")
    worst_now: TipReply | None = Field(description="Deepest lobe as it is; null where it is above 3 ke.")
    steps: int = Field(description="Searches over the range of speeds.")


def campbell_to_dict(found: CampbellDiagram) -> Json:
    """The reply of ``POST /v1/campbell``."""
    return {
        "speed_hz": found.speed_hz,
        "frequency_hz": found.frequency_hz,
        "engine_orders": list(found.engine_orders),
        "crossings": [plain(crossing) for crossing in found.crossings],
    }


def lobes_to_dict(
    ask: LobesQuestion,
    owners: tuple[LobeOwner, ...],
    unstable: tuple[tuple[SpeedInterval, ...], bool] | None,
) -> Json:
    """The reply of ``POST /v1/lobes``."""
    low, high = ask.speed_range_hz
    document: Json = {
        "speed_range_hz": [low, high],
        "ke_max": ask.ke_max,
        "lobes": [plain(owner) for owner in owners],
        **dict.fromkeys(("unstable_speeds_hz", "unstable_share", "proven")),
    }
    if unstable is not None:
        intervals, proven = unstable
        document["unstable_speeds_hz"] = [[found.low_hz, found.high_hz] for found in intervals]
        document["unstable_share"] = sum(found.high_hz - found.low_hz for found in intervals) / (high - low)
        document["proven"] = proven
    return document


def damping_to_dict(found: NeededDamping) -> Json:
    """The reply of ``POST /v1/damping``."""
    document: Json = plain(found)
    return document
