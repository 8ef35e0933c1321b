"""The documentation site, built once for all workers, or the one CI has built already."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from filelock import FileLock

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the built pages; a warning of the build is an error."""
    if built := os.environ.get("BUILT_DOCS"):
        return Path(built)
    if not os.environ.get("CI"):
        pytest.importorskip("sphinx", reason="the documentation's tools are not installed: .[docs]")
    shared = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        shared = shared.parent
    pages, doctrees = shared / "site", shared / "doctrees"
    with FileLock(str(shared / "site.lock")):
        if not (pages / "index.html").exists():
            build = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", "html"]
            done = subprocess.run(
                [*build, "-d", str(doctrees), "docs", str(pages)], cwd=ROOT, capture_output=True, text=True
            )
            assert done.returncode == 0, done.stderr
    return pages
