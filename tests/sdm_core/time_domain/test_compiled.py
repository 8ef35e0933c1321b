"""Machine code is kept where it can be, and made anew where it cannot."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

CODE = """
import numba.core.caching as caching
caching.CacheImpl._locator_classes = []  # no folder that may be written to
from sdm_core.rubbing_blade import single_state_problem
from sdm_core.time_domain.witness import time_witness
print(time_witness(single_state_problem([100.0], 0.01, [[2.0]], [1.0], 60.0, 500.0)).stable)
"""


def test_a_process_that_may_write_nowhere_compiles_for_itself():
    root = Path(__file__).parents[3]
    done = subprocess.run([sys.executable, "-c", CODE], cwd=root, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "True"), done.stderr
