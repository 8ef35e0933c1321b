"""A variable that looks like a setting and is none is said, by name; one that cannot be used is refused."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from sdm_core.errors import InvalidInput
from service import cli
from service.app import create_app
from service.environment import settings_of_environment, unknown_variables
from service.field_values import may_be
from service.settings import Settings

ROOT = Path(__file__).parents[2]
SPOKEN = (".py", ".md", ".yaml", ".yml", ".sh", ".m", ".sbatch", ".service", ".example")


@pytest.mark.parametrize(
    ("name", "meant"),
    [
        ("RUBSCREEN_DATA_FOLDR", "RUBSCREEN_DATA_FOLDER"),
        ("RUBSCREEN_DATABSE_URL", "RUBSCREEN_DATABASE_URL"),
        ("RUBSCREEN_MAXPOINTS", "RUBSCREEN_MAX_POINTS"),
        ("rubscreen_loglevel", "RUBSCREEN_LOG_LEVEL"),
        ("RUBSCREEN_APIKEY", "RUBSCREEN_API_KEY"),
        ("RUBSCREEN_PORT", "--port"),
        ("RUBSCREEN_HOST", "--host"),
        ("RUBSCREEN_QUITE_SOMETHING_ELSE", "docs/how-to/settings.md"),
    ],
)
def test_a_misspelt_setting_is_named_with_the_nearest_and_without_its_value(name, meant):
    (said,) = unknown_variables({name: "secret", "RUBSCREEN_MAX_POINTS": "10", "HOME": "/"})
    assert said.startswith(f"{name} ") and meant in said and "secret" not in said


def test_what_kubernetes_says_of_a_service_of_our_name_is_no_misspelt_setting():
    told = {
        "RUBSCREEN_SERVICE_HOST": "10.0.0.1",
        "RUBSCREEN_SERVICE_PORT_HTTP": "80",
        "RUBSCREEN_PORT": "tcp://10.0.0.1:80",
        "RUBSCREEN_PORT_80_TCP_ADDR": "10.0.0.1",
        "RUBSCREEN_POSTGRES_PORT": "tcp://10.0.0.2:5432",
        "RUBSCREEN_POSTGRES_SERVICE_HOST": "10.0.0.2",
        "RUBSCREEN_POSTGRES_PORT_5432_TCP": "tcp://10.0.0.2:5432",
    }
    assert unknown_variables(told) == []


def test_every_variable_that_the_project_speaks_of_is_known():
    folders = ("sdm_core", "training", "service", "tests", "benchmarks", "docs", "examples")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*")] + list(ROOT.iterdir())
    names: set[str] = set()
    for path in files:
        spoken = path.suffix in SPOKEN or path.name in ("Makefile", "Dockerfile")
        if spoken and path.is_file() and path != Path(__file__):
            names |= set(re.findall(r"\bRUBSCREEN_[A-Z0-9_]*[A-Z0-9]\b", path.read_text(encoding="utf-8")))
    assert {"RUBSCREEN_URL", "RUBSCREEN_PUBLISH", "RUBSCREEN_DATA_FOLDER"} <= names
    odd = {said.split()[0] for said in unknown_variables(dict.fromkeys(names, "x"))}
    # The port of a dask scheduler under SLURM, taken for the service's by many, and a misspelt example.
    assert odd <= {"RUBSCREEN_PORT", "RUBSCREEN_HOST", "RUBSCREEN_DATA_FOLDR"}


def test_every_command_warns_once_and_goes_on(monkeypatch, tmp_path):
    monkeypatch.setenv("RUBSCREEN_DATA_FOLDR", str(tmp_path))
    monkeypatch.setenv("RUBSCREEN_DATA_FOLDER", str(tmp_path / "data"))
    listed = CliRunner().invoke(cli.app, ["keys", "list"])
    assert listed.exit_code == 0
    assert listed.stderr.count("RUBSCREEN_DATA_FOLDR") == 1
    assert "is RUBSCREEN_DATA_FOLDER meant?" in listed.stderr and "warning" in listed.stderr


def test_another_server_that_makes_the_application_logs_it(monkeypatch, caplog):
    monkeypatch.setenv("RUBSCREEN_MAX_POINT", "10")
    with caplog.at_level(logging.WARNING):
        create_app()
    assert [record.getMessage() for record in caplog.records if "RUBSCREEN_MAX_POINT " in record.getMessage()]
    caplog.clear()
    create_app(Settings())
    assert "RUBSCREEN_MAX_POINT " not in caplog.text


@pytest.mark.parametrize("name", Settings.model_fields)
def test_a_setting_that_cannot_be_used_is_refused_by_its_variable_in_words_of_ours(name, monkeypatch):
    field = Settings.model_fields[name]
    words = may_be(field)
    if words in ("text", "a path"):  # which any value of an environment is
        return
    for value in ("", "many", "nan", "-1e999"):
        monkeypatch.setenv(f"RUBSCREEN_{name.upper()}", value)
        with pytest.raises(InvalidInput) as refused:
            settings_of_environment()
        assert refused.value.field == f"RUBSCREEN_{name.upper()}"
        assert value in refused.value.value
        assert refused.value.remedy == f"give {words}, or leave it out"


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("models_poll_s", "a number from 0 up"),
        ("max_points", "a whole number above 0"),
        ("requests_per_minute", "a whole number above 0"),
        ("audit_share_of_time", "a number from 0 to 1"),
        ("run_jobs", "true or false"),
        ("log_level", "one of DEBUG, INFO, WARNING, ERROR"),
        ("data_folder", "a path"),
        ("scheduler", "text"),
    ],
)
def test_what_a_setting_may_be_is_said_in_words(name, words):
    assert may_be(Settings.model_fields[name]) == words
