"""The settings as the environment has them, and what in it looks like a setting and is none."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sdm_core.errors import InvalidInput

if TYPE_CHECKING:
    from service.settings import Settings

PREFIX = "RUBSCREEN_"
# What other parts of the project read: clients, workers, compose.yaml, docs/how-to/slurm.sbatch, tests and
# benchmarks.
_ELSEWHERE = frozenset(
    {
        "RUBSCREEN_URL",
        "RUBSCREEN_API_KEY",
        "RUBSCREEN_WORKER",
        "RUBSCREEN_WORKER_NICE",
        "RUBSCREEN_PUBLISH",
        "RUBSCREEN_TLS",
        "RUBSCREEN_ADDRESS",
        "RUBSCREEN_ENV",
        "RUBSCREEN_FULL_INSTALL",
        "RUBSCREEN_ROTOR_37_SECTIONS",
    }
)
# Kubernetes tells every container of a service `rubscreen` or `rubscreen-...` beside it in such variables.
_OF_KUBERNETES = re.compile(r"RUBSCREEN_(\w+_)?(SERVICE_(HOST|PORT(_\w+)?)|PORT_\d+_(TCP|UDP|SCTP)(_\w+)?)")
_OPTIONS = {"RUBSCREEN_PORT": "--port", "RUBSCREEN_HOST": "--host"}
_WHERE = "docs/how-to/settings.md lists the settings"


def settings_of_environment(**given: Any) -> Settings:
    """The settings of the environment; what is given stands above it.

    Raises
    ------
    InvalidInput
        Naming the environment variable that cannot be used.
    """
    from pydantic import ValidationError

    from service.field_values import remedy_for
    from service.settings import Settings

    try:
        return Settings(**given)
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        name = str(fault["loc"][0])
        raise InvalidInput(
            f"{PREFIX}{name.upper()}", fault["input"], remedy_for(Settings.model_fields[name])
        ) from None


def unknown_variables(environment: Mapping[str, str]) -> list[str]:
    """A warning for each variable that begins like a setting and is none, without its value.

    A warning and not a refusal: the environment is not the service's alone. Kubernetes puts variables into it
    by the names of services, a newer or older release has other settings, and a service that will not start
    after a roll-back is worse than one that says what it passed over. The value may be a misspelt variable's
    password.

    Examples
    --------
    >>> unknown_variables({"RUBSCREEN_DATA_FOLDR": "/data", "HOME": "/root", "RUBSCREEN_URL": "http://rub"})
    ['RUBSCREEN_DATA_FOLDR is read by nothing: is RUBSCREEN_DATA_FOLDER meant?']
    """
    odd = [name for name in sorted(environment) if _unexplained(name.upper(), environment[name])]
    if not odd:  # and so nothing to import, for a command that needs no settings
        return []
    from service.field_values import nearest
    from service.settings import Settings

    settings = {f"{PREFIX}{name.upper()}" for name in Settings.model_fields}
    known = [name.removeprefix(PREFIX) for name in sorted(settings | _ELSEWHERE)]
    found = []
    for name in odd:
        if name.upper() in settings:  # in whatever case
            continue
        # Without the prefix, which would make all of them alike.
        meant = nearest(name.upper().removeprefix(PREFIX), known)
        remedy = _WHERE if meant is None else f"is {PREFIX}{meant} meant?"
        if name.upper() in _OPTIONS:
            remedy = f"`rubscreen serve {_OPTIONS[name.upper()]}` is what to give"
        found.append(f"{name} is read by nothing: {remedy}")
    return found


def _unexplained(name: str, value: str) -> bool:
    if not name.startswith(PREFIX) or name in _ELSEWHERE or _OF_KUBERNETES.fullmatch(name):
        return False
    return not (name.endswith("_PORT") and value.startswith(("tcp://", "udp://", "sctp://")))
