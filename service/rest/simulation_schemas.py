"""Results of simulations on the wire, as OpenAPI shows them."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field

Column = list[float | None]
Rows = list[list[float | None]]


class EnergyReply(BaseModel):
    """The blade's energy account at the end, J."""

    model_config = ConfigDict(extra="forbid")

    energy_j: float = Field(description="Kinetic and strain energy that is left.")
    work_of_damping_j: float
    work_of_contact_j: float
    work_of_friction_j: float
    imbalance_j: float = Field(description="That came from nowhere.")


class SimulationReply(BaseModel):
    """Figures by speed; wear maps, spectra and the response are arrays of the npz."""

    model_config = ConfigDict(extra="forbid")

    job: str
    complete: bool = Field(description="False while the job runs: of the speeds there are so far.")
    blade: str
    contact_nodes: list[str]
    tip_nodes: list[str]
    revolutions: int
    ke: float = Field(description="K_e of each contact node, N/m.")
    critical_ke_factor: float = Field(
        description="The liner's critical K_e over that of the delay equation; exact verdicts allow for it."
    )
    cells: int
    speed_hz: list[float]
    wear_lobes: list[list[int]] = Field(
        description="By speed and contact node: strongest harmonic of the worn profile but the ovalisation's."
    )
    lobe_amplitude_m: Rows
    deepest_m: Rows = Field(description="Deepest wear by speed and contact node.")
    worn_volume_m3: Column
    worn_through: list[bool] = Field(description="The liner was, which ended the simulation of that speed.")
    peak_m: Rows = Field(description="Largest displacement by speed and tip node.")
    force_peak_n: Rows = Field(description="Largest contact force by speed and contact node.")
    strongest_hz: Column = Field(description="Of the first contact node over the last revolutions.")
    natural_hz: Rows = Field(description="Natural frequencies by speed.")
    cell_damping_ratio: Rows = Field(
        description="What the length of the cells adds to each damping ratio, by speed and mode."
    )
    energy_imbalance: Column = Field(description="Relative to the largest term of the energy account.")
    stable: list[bool | None] = Field(description="Permanent contact, by the exact core.")
    growth_per_revolution: Column = Field(description="Of it: ln of the spectral radius.")
    chatter_hz: Column
    unstable_speeds_hz: list[list[float]] = Field(
        description="Intervals of speed unstable in permanent contact, by the exact core; at the end of many "
        "speeds."
    )
    energy: EnergyReply | None = Field(description="Of one speed; null for many.")
