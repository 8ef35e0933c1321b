"""What every test may count on."""

from __future__ import annotations

import os
import sys
from pathlib import Path

# Programs of this environment (`dask`, `rubscreen`) by their names, though nobody activated it.
os.environ["PATH"] = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
