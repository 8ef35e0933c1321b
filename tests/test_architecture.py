"""Imports run one way: service → training → sdm_core."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LAYERS = ("sdm_core", "training", "service")
FORBIDDEN = {
    "sdm_core": {
        "training",
        "service",
        "tests",
        "benchmarks",
        "torch",
        "sklearn",
        "fastapi",
        "pydantic",
        "uvicorn",
    },
    "training": {"service", "tests", "benchmarks", "fastapi", "pydantic", "uvicorn"},
    "service": {"tests", "benchmarks"},
}


def imported_by(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (name.name.partition(".")[0] for name in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            yield (node.module or "").partition(".")[0]


@pytest.mark.parametrize("layer", LAYERS)
def test_nothing_imports_from_a_layer_above(layer):
    files = sorted((ROOT / layer).rglob("*.py"))
    assert files
    wrong = {str(path.relative_to(ROOT)): FORBIDDEN[layer] & set(imported_by(path)) for path in files}
    assert {path: names for path, names in wrong.items() if names} == {}


def loaded_after(statement: str) -> set[str]:
    code = f"import sys\n{statement}\nprint(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


def test_the_exact_core_runs_without_torch_and_without_a_web_framework():
    modules = " , ".join(
        ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        for path in sorted((ROOT / "sdm_core").rglob("*.py"))
    )
    assert not loaded_after(f"import {modules}") & {"torch", "fastapi", "pydantic", "uvicorn", "sklearn"}


def test_integration_in_time_shares_nothing_with_what_it_bears_witness_to():
    loaded = loaded_after("import sdm_core.time_domain.witness, sdm_core.time_domain.fitted_growth")
    solvers = ("semi_discretization", "collocation", "floquet", "permanent_contact", "stability", "boundary")
    assert [
        name for name in loaded if name.startswith(tuple(f"sdm_core.{solver}" for solver in solvers))
    ] == []


def test_the_command_line_shows_its_help_without_loading_numpy_or_torch():
    assert not loaded_after("import service.cli") & {"torch", "numpy", "scipy", "fastapi", "matplotlib"}


def test_no_file_is_named_after_no_subject():
    nameless = {"utils.py", "util.py", "helpers.py", "common.py", "misc.py"}
    assert [str(p) for layer in LAYERS for p in (ROOT / layer).rglob("*.py") if p.name in nameless] == []
