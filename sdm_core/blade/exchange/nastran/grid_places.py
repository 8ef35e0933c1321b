"""Places of nodes, and the directions of their displacements, from GRID entries of Nastran bulk data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from sdm_core.blade.exchange.content import Positions
from sdm_core.blade.exchange.nastran.bulk_data import Entry
from sdm_core.blade.exchange.nastran.coordinate_systems import CoordinateSystem
from sdm_core.blade.exchange.parsing.fortran_fields import integer, real
from sdm_core.errors import DamagedFile, InvalidInput


def grid_places(
    path: Path, grids: Sequence[Entry], systems: Mapping[int, CoordinateSystem], wanted: set[int]
) -> tuple[Positions, dict[int, np.ndarray]]:
    """Basic x, y, z of nodes in the file's lengths, and unit vectors of those with directions of their own.

    GRID: number, system of the place (CP), three coordinates, system of the displacements (CD).

    Parameters
    ----------
    path
        The file.
    grids
        GRID entries.
    systems
        By number.
    wanted
        Nodes in the matrices: others may be in systems that the file does not hold, and are left out.

    Raises
    ------
    InvalidInput
        For a node in a system that the file does not hold.
    DamagedFile
        For a field that is no number, or a node placed twice.
    """
    places: Positions = {}
    directions: dict[int, np.ndarray] = {}
    for entry in grids:
        where = f"{path.name}: line {entry.line}"
        node = integer(where, entry.field(0))
        of_place, of_motion = (integer(where, entry.field(i) or "0") for i in (1, 5))
        unknown = [s for s in (of_place, of_motion) if s != 0 and s not in systems]
        if unknown and node not in wanted:
            continue
        if unknown:
            raise InvalidInput(
                f"{where}: GRID {node}",
                f"system {unknown[0]}",
                "add its CORD2R, CORD2C or CORD2S entry, or give the node in the basic system (0)",
            )
        if node < 1 or node in places:
            raise DamagedFile(
                where, f"GRID {node}", "give every node one place" if node in places else "number from 1"
            )
        place = np.array([real(where, entry.field(i) or "0.0") for i in (2, 3, 4)])
        if of_place:
            place = systems[of_place].place(place)
        x, y, z = place.tolist()
        places[node] = (x, y, z)
        if of_motion and node in wanted:
            directions[node] = systems[of_motion].directions(f"{where}: GRID {node}", place)
    return places, directions
