"""What the service answers, as OpenAPI shows it; a test holds every answer against its model."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field

Source = Literal["surrogate", "exact"]
Reason = Literal["confident", "near_boundary", "out_of_domain", "requested"]
SlopeReason = Literal["confident", "near_boundary", "unsure_slope", "out_of_domain", "requested"]

_LOADING = "The model being loaded while the active one answers; null where there is none."
_FAULT = "Why the model that the folder names does not answer; null where it does."


class CertificateReply(BaseModel):
    """The bound that the surrogate's answers keep."""

    model_config = ConfigDict(extra="forbid")

    alpha: float = Field(description="Bound on the rate of unstable points among those it calls stable.")
    confidence: float = Field(description="That the bound holds.")
    distribution: str = Field(description="Of blades, speeds and stiffnesses, on which it holds.")
    spreads: float = Field(description="Points nearer to the boundary than this many spreads are verified.")


class Reply(BaseModel):
    """What every answer says about where it comes from."""

    model_config = ConfigDict(extra="forbid")

    model: str | None = Field(description="The surrogate; null where none is loaded.")
    solver: str = Field(description="The exact method.")
    certificate: CertificateReply | None = Field(
        description="null where the surrogate was not asked, or answered unverified."
    )


class PointsReply(Reply):
    """Verdicts, one a point. An entry is null where its source does not compute it."""

    stable: list[bool | None] = Field(description="null: not decided to tolerance.")
    unstable_probability: list[float | None] = Field(description="The surrogate's.")
    spectral_radius: list[float | None] = Field(description="The exact core's.")
    growth_per_revolution: list[float | None] = Field(description="ln of the spectral radius.")
    chatter_hz: list[float | None]
    error_estimate: list[float | None]
    unstable_multipliers: list[int | None] = Field(description="Floquet multipliers outside the circle.")
    wear_lobes: list[float | None] = Field(description="Per revolution: chatter_hz over speed_hz.")
    source: list[Source]
    reason: list[Reason]


class BoundaryReply(Reply):
    """The first crossing at each speed."""

    critical_ke: list[float | None] = Field(description="N/m; null where there is none below ke_max.")
    chatter_hz: list[float | None]
    error_estimate: list[float | None]
    unstable_ke: list[list[tuple[float, float]] | None] = Field(
        description="Intervals of instability below ke_max, N/m; null where the surrogate answered."
    )
    source: list[Source]
    reason: list[Reason]


class SensitivitiesReply(Reply):
    """What moves the first crossing: one row a speed, one column a parameter."""

    critical_ke: list[float | None] = Field(description="N/m; null where there is none below ke_max.")
    chatter_hz: list[float | None]
    error_estimate: list[float | None] = Field(description="Of critical_ke, relative.")
    parameter: list[str] = Field(
        description="In words, e.g. `frequency of mode 1`. The rotor speed comes twice: with the modal data "
        "moving as the blade's states say, and frozen."
    )
    unit: list[str]
    value: list[list[float]] = Field(description="Of each parameter at each speed, in its unit.")
    derivative: list[list[float | None]] = Field(
        description="dK_e/dp, N/m per unit; null where there is no crossing, or it has no derivative."
    )
    relative: list[list[float | None]] = Field(
        description="d ln K_e/d ln p: per cent of K_e by one per cent of it. For the edge of an arc "
        "d ln K_e per revolution."
    )
    source: list[Source]
    reason: list[SlopeReason]


class MapReply(Reply):
    """Verdicts on a grid, those asked for by `fields`: rows go with `ke`, columns with `speed_hz`."""

    speed_hz: list[float]
    ke: list[float]
    stable: list[list[bool | None]] = Field(description="null: not decided to tolerance.")
    unstable_probability: list[list[float | None]]
    source: list[list[Source]]
    reason: list[list[Reason]]
    exact_share: float = Field(description="Share of the points the exact core answered.")
    unstable_share: float | None = Field(description="Share of the decided points that are unstable.")


class FindingReply(BaseModel):
    """Something about a blade that may be wrong, or is worth knowing."""

    model_config = ConfigDict(extra="forbid")

    severity: Literal["warning", "note"]
    field: str
    what: str
    remedy: str


class ReductionReply(BaseModel):
    """The reduced model's modes against the full one's, at a speed between those of the states."""

    model_config = ConfigDict(extra="forbid")

    speed_hz: float
    full_frequency_hz: list[float]
    frequency_error: list[float] = Field(description="Relative, one a mode.")
    shape_error: list[float] = Field(description="Of the tip amplitudes, relative to each mode's largest.")


class BuildReply(BaseModel):
    """How a profile became modal data."""

    model_config = ConfigDict(extra="forbid")

    mesh_nodes: int
    full_size: int = Field(description="Degrees of freedom of the finite-element model.")
    reduced_size: int
    seconds: float
    reduction: ReductionReply | None = Field(description="null where it was not asked for.")


class BladeReply(BaseModel):
    """A checked blade file, ready for the other endpoints."""

    model_config = ConfigDict(extra="forbid")

    blade: dict[str, Any] = Field(description="The blade file (rubscreen/blade/1).")
    build: BuildReply | None = Field(description="null where modal data were given.")
    findings: list[FindingReply] = Field(description="What an engineer should look at, if anything.")


class ProblemDocument(BaseModel):
    """RFC 9457 problem details, with the field, its value and the remedy."""

    type: str
    title: str
    status: int
    detail: str
    instance: str
    field: str = Field(description="Where, as the caller wrote it, e.g. `blade.states[0].frequency_hz[1]`.")
    value: str = Field(description="What was found there.")
    remedy: str = Field(description="What to do.")
    request_id: str | None = Field(description="As in the X-Request-Id header.")


class Alive(BaseModel):
    """The process runs."""

    status: Literal["alive"] = "alive"
    version: str


class CheckReply(BaseModel):
    """One of the things that were checked."""

    ok: bool
    needed: bool = Field(description="False for what is worth knowing and keeps nobody from answering.")
    detail: str = Field(description="What was found, in words.")


class Ready(BaseModel):
    """The service answers."""

    status: Literal["ready"] = "ready"
    model: str | None
    solver: str
    loading: str | None = Field(None, description=_LOADING)
    fault: str | None = Field(None, description=_FAULT)
    checks: dict[str, CheckReply] = Field(
        {}, description="Each by its name: self_check, database, disk, audit."
    )


class Model(BaseModel):
    """A surrogate of the registry."""

    id: str
    active: bool = Field(description="True for the one that answers.")
    card: dict[str, Any] = Field(description="What it was trained on, where it holds, how often it errs.")
    damage: str | None = Field(None, description="What is wrong with its files; null when they are whole.")


class Models(BaseModel):
    """The surrogates there are."""

    models: list[Model]
    loading: str | None = Field(None, description=_LOADING)
    fault: str | None = Field(None, description=_FAULT)
