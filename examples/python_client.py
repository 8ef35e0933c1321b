"""Ask a running service (rubscreen serve) about NASA rotor 37, waiting and awaiting.

Run: [RUBSCREEN_API_KEY=...] python examples/python_client.py [URL]
"""

from __future__ import annotations

import asyncio
import sys

import numpy as np

from sdm_core.blade import example_blade
from sdm_core.contact import ContactConfiguration
from service.client import AsyncClient, Client, ServiceProblem, progress_bar

BLADE = example_blade("nasa_rotor_37")
LEADING_EDGE = ContactConfiguration.at("LE")


def waiting(url: str) -> None:
    """Questions one after the other; a large one goes out as npz, in parts."""
    speed_hz, ke = (
        grid.ravel() for grid in np.meshgrid(np.linspace(150, 300, 400), np.linspace(0, 25e3, 300))
    )
    with Client(url) as client:  # key=... here, or RUBSCREEN_API_KEY
        exact = client.boundary(BLADE, LEADING_EDGE, [200.0, 241.0], 25e3, policy="exact")
        print("unstable from", exact.critical_ke.round(1), "N/m on")
        with progress_bar("points") as progress:
            found = client.points(BLADE, LEADING_EDGE, speed_hz, ke, "surrogate", progress=progress)
        print(f"{found.stable.size:,} points, {np.mean(found.stable == 0.0):.1%} of them unstable")
        try:
            client.points(BLADE, LEADING_EDGE, [241.0], [-1.0])
        except ServiceProblem as refused:
            print("refused:", refused)


async def awaiting(url: str) -> None:
    """Questions at the same time."""
    contacts = {"leading": LEADING_EDGE, "trailing": ContactConfiguration.at("TE")}
    async with AsyncClient(url) as client:
        speed_hz, ke = np.linspace(150.0, 300.0, 40), np.linspace(0.0, 25e3, 40)
        maps = await asyncio.gather(
            *(client.map(BLADE, contact, speed_hz, ke) for contact in contacts.values())
        )
    for name, found in zip(contacts, maps, strict=True):
        print(
            f"{name} edge: {found.unstable_share:.1%} of the map unstable, {found.exact_share:.1%} verified"
        )


if __name__ == "__main__":
    address = sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8000"
    waiting(address)
    asyncio.run(awaiting(address))
