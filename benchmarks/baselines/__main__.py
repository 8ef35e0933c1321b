"""`python -m benchmarks.baselines --write docs/baselines.md`: compare, and put the tables into a document."""

from __future__ import annotations

import argparse
from pathlib import Path

from rich.console import Console

from benchmarks.baselines.report import compared, rendered, write
from training.registry import SHIPPED

parser = argparse.ArgumentParser(prog="python -m benchmarks.baselines")
parser.add_argument("--write", type=Path, help="document whose tables are to be replaced")
parser.add_argument(
    "--models", type=Path, default=SHIPPED, help="folder whose active model is the shipped one"
)
if __name__ == "__main__":  # processes that are started read this file again
    options = parser.parse_args()
    found = compared(options.models)
    Console(width=150).print(rendered(found))
    if options.write is not None:
        write(found, options.write)
