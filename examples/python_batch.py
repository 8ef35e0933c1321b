"""Screen a batch of blades as a durable job of a running service (rubscreen serve), and rank them.

Run: [RUBSCREEN_API_KEY=...] python examples/python_batch.py [URL]
"""

from __future__ import annotations

import sys
from dataclasses import replace

from sdm_core.blade import Blade, example_blade
from sdm_core.contact import ContactConfiguration
from service.client import Client, JobNotDone, job_bar
from service.jobs.screening.request import Criteria

CONTACTS = {"leading edge": ContactConfiguration.at("LE"), "both edges": ContactConfiguration.at("LE", "TE")}


def family() -> list[Blade]:
    """Rotor 37 with more and more damping; `read_blade(path)` reads blades of your own."""
    rotor = example_blade("nasa_rotor_37")
    blades = []
    for factor in (1.0, 1.5, 2.0):
        ratios = [factor * ratio for ratio in rotor.damping_ratio]
        blades.append(replace(rotor, name=f"damping x {factor:g}", damping_ratio=ratios))
    return blades


def main(url: str) -> None:
    """Hand the batch in, wait, and print the ranking."""
    with Client(url) as client:
        job = client.submit_screening(
            [*family(), "generic_compressor_blade"],  # objects, documents, uploads and examples, mixed
            CONTACTS,
            ke_liner=9000.0,
            criteria=Criteria(least_margin=0.2),
            map_shape=(32, 32),
            name="damping study",
        )
        try:
            with job_bar("damping study") as progress:
                client.wait(job.id, progress)  # client.wait(job.id) from another process does as well
        except JobNotDone as problem:
            sys.exit(str(problem))
        found = client.screening_results(job.id)
    for row in found.rows:
        smallest = "none" if row.smallest_unstable_ke is None else f"{row.smallest_unstable_ke:,.0f} N/m"
        missed = f"misses {', '.join(row.criteria_missed or ())}"
        verdict = "meets the criteria" if row.meets_criteria else missed
        print(f"{row.rank}. {row.blade}, {row.contact_name}: {smallest}, {verdict}")
    for blade in found.not_screened:
        print(f"not screened: {blade.source}: {blade.reason}")
    found.to_csv("ranking.csv")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "http://127.0.0.1:8000")
