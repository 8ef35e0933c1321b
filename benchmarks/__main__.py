"""`make bench`: all measurements, or those named (accuracy, speed)."""

from __future__ import annotations

import sys

from rich.console import Console

from benchmarks import map_speed, screening_accuracy

MEASUREMENTS = {"accuracy": screening_accuracy.table, "speed": map_speed.table}


def main() -> int:
    names = sys.argv[1:] or list(MEASUREMENTS)
    unknown = [name for name in names if name not in MEASUREMENTS]
    if unknown:
        print(f"measurement = {unknown[0]}: name one of {', '.join(MEASUREMENTS)}", file=sys.stderr)
        return 2
    for name in names:
        Console(width=150).print(MEASUREMENTS[name]())
    return 0


if __name__ == "__main__":
    sys.exit(main())
