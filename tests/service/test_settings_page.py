"""The page of settings is what the settings are."""

from __future__ import annotations

import re
from pathlib import Path

from service.settings import Settings
from service.settings_page import meanings, settings_page

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "settings.md"


def test_the_page_of_settings_is_the_one_the_settings_make():
    again = "python -m service.settings_page > docs/how-to/settings.md"
    assert PAGE.read_text(encoding="utf-8") == settings_page(), again


def test_every_setting_and_nothing_else_has_its_meaning_written():
    said = meanings()
    assert list(said) == list(Settings.model_fields)
    assert all(text.endswith(".") and len(text) >= 10 for text in said.values()), said


def test_the_page_is_the_same_on_every_machine(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 61)
    monkeypatch.setenv("RUBSCREEN_MAX_POINTS", "7")
    assert settings_page() == PAGE.read_text(encoding="utf-8")
    assert Settings().worker_threads == 61


def test_the_index_leads_to_every_how_to_and_to_nothing_that_is_not_there():
    linked = set(re.findall(r"\]\(([^)]+)\)", (PAGE.parent / "README.md").read_text(encoding="utf-8")))
    assert {path.name for path in PAGE.parent.iterdir()} - {"README.md", "index.md"} <= linked
    assert all((PAGE.parent / where).exists() for where in linked)
