"""An assessment's charts by file name."""

from __future__ import annotations

from sdm_core.assessment import Assessment
from sdm_core.assessment.mode_lobes import mode_boundaries
from sdm_core.assessment.robust_band import robust_band
from sdm_core.boundary import boundary
from sdm_core.lobe_tips import lobe_grid
from service.screening.assessment_charts import campbell_png, clearance_png, mode_lobes_png, robust_png
from service.speeds import evenly_spaced

_SPEEDS = 300


def assessment_charts(found: Assessment) -> dict[str, bytes]:
    """Campbell diagram and lobes by mode always; clearance and uncertainty where they were asked for."""
    blade, contact, ke_max = found.blade, found.contact, found.ke_max
    grid = lobe_grid(blade, contact, evenly_spaced(*found.speed_range_hz, _SPEEDS), ke_max)
    full = boundary(blade, contact, grid, ke_max, truncation=False)
    alone = mode_boundaries(blade, contact, grid, ke_max)
    charts = {"campbell.png": campbell_png(found), "lobes_by_mode.png": mode_lobes_png(found, full, alone)}
    if found.clearance.running_clearance_m is not None:
        charts["clearance.png"] = clearance_png(found.clearance, blade.name, found.kinds)
    if found.robust_range is not None and contact.permanent:
        band = robust_band(blade, contact, grid, ke_max)
        charts["uncertainty.png"] = robust_png(
            band, blade.name, full, found.robust_range, ke_liner=found.ke_liner
        )
    return charts
