"""What the pages show is what happens: their examples run, and the names they give are there."""

from __future__ import annotations

import doctest
import importlib
import re
import shlex
from pathlib import Path

import pytest
from typer.testing import CliRunner

from service.cli import app

ROOT = Path(__file__).parents[2]
PAGES = sorted(ROOT.glob("docs/**/*.md"))
OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
NAME = re.compile(r"`((?:sdm_core|training|service)(?:\.\w+)+)`")


def blocks(page: Path, language: str) -> list[str]:
    """Blocks of one language, in order."""
    text = page.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def named(pages: list[Path]) -> list[object]:
    return [pytest.param(page, id=str(page.relative_to(ROOT / "docs"))) for page in pages]


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
@pytest.mark.parametrize("page", named([page for page in PAGES if blocks(page, "pycon")]))
def test_the_python_examples_of_a_page_give_what_it_says(page, tmp_path, monkeypatch):
    monkeypatch.setenv("RUBSCREEN_DATA_FOLDER", str(tmp_path))
    text = "\n".join(blocks(page, "pycon"))
    example = doctest.DocTestParser().get_doctest(text, {}, str(page), str(page), 0)
    runner = doctest.DocTestRunner(optionflags=OPTIONS)
    said: list[str] = []
    failed = runner.run(example, out=said.append).failed
    assert failed == 0, "".join(said)


@pytest.mark.parametrize("page", named([page for page in PAGES if blocks(page, "console")]))
def test_the_commands_of_a_page_print_what_it_says(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "120")
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for block in blocks(page, "console"):
        for session in re.split(r"^\$ ", block, flags=re.MULTILINE)[1:]:
            command, _, expected = session.partition("\n")
            words = shlex.split(command)
            assert words[0] == "rubscreen"
            done = CliRunner().invoke(app, words[1:])
            assert done.exit_code == 0, done.output
            matches = doctest.OutputChecker().check_output(expected, plain(done.output), OPTIONS)
            assert not expected or matches, f"{command}\n{done.output}"


def plain(text: str) -> str:
    """Without the lines of tables."""
    return re.sub(r"[━─┃│┏┓┗┛┡┩╇┳┻┌┐┬└┘┴├┤┼╭╮╰╯]", " ", text)


@pytest.mark.parametrize(
    "page", named([page for page in PAGES if NAME.search(page.read_text(encoding="utf-8"))])
)
def test_every_name_of_the_code_on_a_page_is_there(page):
    for name in set(NAME.findall(page.read_text(encoding="utf-8"))):
        assert exists(name), f"{page}: {name}"


def exists(name: str) -> bool:
    """Whether a dotted name can be imported, module and attributes."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        try:
            found: object = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[k:]:
            fields = getattr(found, "__dataclass_fields__", {})
            if attribute not in fields and not hasattr(found, attribute):
                return False
            found = getattr(found, attribute, None)
        return True
    return False


def test_a_name_that_is_not_there_is_seen():
    assert not exists("sdm_core.stability.nothing") and exists("sdm_core.contact.ContactConfiguration.arcs")
