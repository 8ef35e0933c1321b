"""Files that are whole or not there at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sdm_core.errors import InvalidInput


@contextmanager
def staged(path: str | Path, field: str = "path") -> Iterator[Path]:
    """A place beside `path` to write to under its name; what lies there at the end is moved into place.

    Several files may be written beside each other; none of them replaces an older one unless all were
    written. What a failure or an interruption leaves is removed.

    Raises
    ------
    InvalidInput
        Naming `field` and the path, when it cannot be written (no such folder, a full disk).

    Examples
    --------
    >>> import tempfile
    >>> target = Path(tempfile.mkdtemp()) / "a.txt"
    >>> with staged(target) as beside:
    ...     _ = beside.write_text("whole")
    >>> target.read_text()
    'whole'
    """
    path = Path(path)
    folder: str | None = None
    try:
        folder = tempfile.mkdtemp(dir=path.resolve().parent, prefix=f".{path.name}.")
        yield Path(folder) / path.name
        for made in sorted(Path(folder).iterdir()):
            os.replace(made, path.resolve().parent / made.name)
    except OSError as error:
        raise InvalidInput(
            field, str(path), f"it cannot be written ({error.strerror or error}): give another place"
        ) from None
    finally:
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)
