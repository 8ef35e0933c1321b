"""The page of settings; ``python -m service.settings_page`` prints what ``docs/how-to/settings.md`` holds."""

from __future__ import annotations

import inspect
import sys
from typing import Any

from pydantic.fields import FieldInfo

from service.environment import PREFIX
from service.field_values import may_be
from service.settings import Settings

_MIB = 2**20
_HEAD = """# Settings

Every setting of `rubscreen serve`, and of the commands that look into its data folder, is an environment
variable. What is not set has its default; an option of the command (`--data`, `--models`, `--keep-answers`,
`--database-url`) stands above its variable. A value that cannot be used stops the start, and a variable that
begins with `RUBSCREEN_` and is read by nothing is named on standard error.

This page is written by `python -m service.settings_page` from `service/settings.py`; a test holds it to that.

| setting | environment variable | default | may be | meaning |
|---|---|---|---|---|
"""
_TAIL = """
Read by others than the service:

| environment variable | read by | |
|---|---|---|
| `RUBSCREEN_URL` | commands that ask a running service | its address, instead of `--url` |
| `RUBSCREEN_API_KEY` | clients, and commands with `--url` | the key they send |
| `RUBSCREEN_WORKER_NICE` | workers of jobs | 0 leaves them at the priority they were started with |
| `RUBSCREEN_PUBLISH` | `compose.yaml` | address and port it is published on |
| `RUBSCREEN_TLS`, `_ADDRESS`, `_PORT`, `_ENV` | `docs/how-to/slurm.sbatch` | its head says what they are |
"""


def settings_page() -> str:
    """The page, in Markdown."""
    said = meanings()
    rows = [_row(name, field, said[name]) for name, field in Settings.model_fields.items()]
    return _HEAD + "\n".join(rows) + "\n" + _TAIL


def meanings() -> dict[str, str]:
    """What each setting means, from the attributes in the docstring of `Settings`."""
    found: dict[str, str] = {}
    names: list[str] = []
    attributes = str(inspect.getdoc(Settings)).partition("Attributes\n----------\n")[2]
    for line in attributes.partition("\n\n")[0].splitlines():
        if not line.startswith(" "):
            names = [name.strip() for name in line.split(",")]
            found |= dict.fromkeys(names, "")
        else:
            found |= {name: f"{found[name]} {line.strip()}".strip() for name in names}
    return found


def _row(name: str, field: FieldInfo, meaning: str) -> str:
    cells = (
        f"`{name}`",
        f"`{PREFIX}{name.upper()}`",
        _default(name, field),
        may_be(field),
        meaning.replace("None", "none"),
    )
    # As Markdown writes code, and None as the column of defaults does.
    return "| " + " | ".join(cell.replace("``", "`").replace("|", "\\|") for cell in cells) + " |"


def _default(name: str, field: FieldInfo) -> str:
    if field.default_factory is not None:
        return "cores of the machine"
    default: Any = field.default
    if default is None:
        return "none"
    if isinstance(default, bool):
        return str(default).lower()
    if name.endswith("_bytes") and default % _MIB == 0:
        return f"{default} ({default // _MIB} MiB)"
    return f"{default:g}" if isinstance(default, float) else str(default)


if __name__ == "__main__":
    sys.stdout.write(settings_page())
