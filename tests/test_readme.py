"""What the README shows is what happens."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def test_the_python_example_prints_what_the_readme_says(capsys):
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL).group(1)
    said = [line for line in code.splitlines() if line.startswith("# ")]
    exec(compile(code, "README.md", "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    assert len(printed) == 3 + 4 + 1
    exact, tip, point, slopes, share = said[:5]
    found = numbers(printed[0])
    np.testing.assert_allclose(found[:4], numbers(exact)[:4], rtol=1e-5)
    assert max(found[4:6]) < 1e-10
    np.testing.assert_allclose(numbers(printed[1]), numbers(tip), rtol=3e-3)
    assert point.removeprefix("# ").split()[:3] == printed[2].split()[:3]
    assert numbers(printed[2])[1] == pytest.approx(numbers(point)[1], rel=0.01)
    assert [line in slopes for line in printed[3:7]] == [True] * 4
    assert numbers(printed[7]) == pytest.approx(numbers(share)[:2], abs=1e-3)


def numbers(text: str) -> list[float]:
    return [float(x) for x in re.findall(r"(?<![\w.])-?\d+\.?\d*(?:e[-+]\d+)?", text)]


def test_the_model_the_readme_speaks_of_is_the_shipped_one():
    from training.registry import active_id

    assert active_id() in README
