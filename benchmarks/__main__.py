"""`make bench`: the comparison with peers, or the measurements named (see `MEASUREMENTS`)."""

from __future__ import annotations

import sys
from importlib import import_module

from rich.console import Console

MEASUREMENTS = {
    "peers": "benchmarks.peers.report",
    "arcs": "benchmarks.random_arcs",
    "convergence": "benchmarks.convergence",
    "scaling": "benchmarks.scaling",
    "maps": "benchmarks.maps",
    "profiles": "benchmarks.profile_folder",
    "rotor37": "benchmarks.rotor_37_blade",
    "accuracy": "benchmarks.screening_accuracy",
    "baselines": "benchmarks.baselines.report",
    "certificate": "benchmarks.certificate",
    "blades": "benchmarks.real_blades",
    "architectures": "benchmarks.architectures",
    "surrogate_speed": "benchmarks.surrogate_speed",
    "learning": "benchmarks.learning_curve",
    "gradients": "benchmarks.gradients",
    "speed": "benchmarks.map_speed",
    "audit": "benchmarks.audit",
    "extensions": "benchmarks.model_extensions",
    "witness": "benchmarks.time_witness",
    "liner": "benchmarks.time_domain_liner",
    "page": "benchmarks.page_speed",
}


def main() -> int:
    names = sys.argv[1:] or ["peers"]
    unknown = [name for name in names if name not in MEASUREMENTS]
    if unknown:
        print(f"measurement = {unknown[0]}: name one of {', '.join(MEASUREMENTS)}", file=sys.stderr)
        return 2
    for name in names:
        try:  # one by one, so that accuracy and speed do not need the packages of the peers
            measurement = import_module(MEASUREMENTS[name])
        except ModuleNotFoundError as missing:
            print(
                f"{missing.name} is not installed: run make bench, or pip install -e '.[bench]'",
                file=sys.stderr,
            )
            return 2
        Console(width=150).print(measurement.table())
    return 0


if __name__ == "__main__":
    sys.exit(main())
