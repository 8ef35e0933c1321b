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
    printed = [float(x) for x in re.findall(r"[-\d.]+(?:e[-+]\d+)?", capsys.readouterr().out)]
    promised = [float(x) for x in re.findall(r"(?<![\w.])\d+\.\d+", said[0])]
    np.testing.assert_allclose(printed[:4], promised[:4], rtol=1e-5)
    assert max(printed[4:6]) < 1e-10
    unstable, exact = (float(x) for x in re.findall(r"0\.\d+", said[1]))
    assert printed[6:] == pytest.approx([unstable, exact], abs=1e-3)


def test_the_model_the_readme_speaks_of_is_the_shipped_one():
    from training.registry import active_id

    assert active_id() in README
