"""Files of served cases: written whole, checksummed, the oldest dropped."""

from __future__ import annotations

import hashlib
import io
import json
import logging
import secrets
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.errors import DamagedFile
from sdm_core.whole_files import staged
from training.served_cases import ServedCases

FORMAT = "rubscreen/served/1"
_PREFIX = "served-"
logger = logging.getLogger("rubscreen.training")


def write_chunk(folder: Path, cases: ServedCases) -> Path:
    """Write a chunk; its name says when, and how many rows.

    Raises
    ------
    InvalidInput
        When it cannot be written.
    """
    arrays: dict[str, Any] = {f.name: getattr(cases, f.name) for f in fields(cases)}
    header = json.dumps({"format": FORMAT, "sha256": _digest(arrays)}).encode()
    buffer = io.BytesIO()
    np.savez_compressed(buffer, header=np.frombuffer(header, np.uint8), **arrays)
    # Sorted by name is sorted by age; processes that write at the same instant still differ.
    path = folder / f"{_PREFIX}{time.time_ns():020d}-{secrets.token_hex(4)}-{len(cases)}.npz"
    with staged(path, "served answers") as beside:
        beside.write_bytes(buffer.getvalue())
    return path


def read_chunk(path: Path) -> ServedCases:
    """Read a chunk back.

    Raises
    ------
    DamagedFile
        When it is cut short, altered or of another kind.
    """
    try:
        with np.load(io.BytesIO(path.read_bytes()), allow_pickle=False) as data:
            header = json.loads(bytes(data["header"]))
            found = ServedCases(*(data[f.name] for f in fields(ServedCases)))
    except Exception as error:  # zipfile and zlib raise their own kinds
        raise DamagedFile("served answers", str(path), f"it cannot be read ({error}); delete it") from None
    arrays = {f.name: getattr(found, f.name) for f in fields(found)}
    if header.get("format") != FORMAT or header.get("sha256") != _digest(arrays):
        raise DamagedFile("served answers", str(path), "its checksum does not hold; delete it")
    return found


def chunks(folder: Path) -> list[Path]:
    """The chunks of a folder, oldest first."""
    return sorted(folder.glob(f"{_PREFIX}*.npz"))


def whole_chunks(paths: list[Path]) -> list[ServedCases]:
    """What can be read of them; the rest is skipped with a warning."""
    found = []
    for path in paths:
        try:
            found.append(read_chunk(path))
        except DamagedFile as error:
            if path.exists():  # another process may have dropped or replaced it
                logger.warning("skipped: %s", error)
    return found


def every_chunk(folder: Path) -> list[ServedCases]:
    """All that can be read, while others write: a chunk may be replaced by a fuller one at any time."""
    known: set[Path] = set()
    found: list[ServedCases] = []
    while unknown := [path for path in chunks(folder) if path not in known]:
        known.update(unknown)
        found += whole_chunks(unknown)
    return found


def drop_oldest(folder: Path, most_rows: int, most_files: int) -> None:
    """Delete the oldest chunks until what is left is within both bounds."""
    rows = 0
    for number, path in enumerate(reversed(chunks(folder)), 1):
        rows += _rows(path)
        if (rows > most_rows or number > most_files) and number > 1:
            path.unlink(missing_ok=True)


def _rows(path: Path) -> int:
    count = path.stem.rpartition("-")[2]
    return int(count) if count.isdigit() else 0


def _digest(arrays: dict[str, np.ndarray]) -> str:
    h = hashlib.sha256()
    for name, array in arrays.items():
        h.update(name.encode() + str(array.dtype).encode() + str(array.shape).encode())
        h.update(np.ascontiguousarray(array).tobytes())
    return h.hexdigest()
