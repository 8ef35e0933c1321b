"""Labelled cases with their provenance, immutable once written."""

from __future__ import annotations

import hashlib
import io
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from sdm_core.errors import DamagedFile, InvalidInput
from sdm_core.version import __version__
from training.cases import CaseBatch

FORMAT = "rubscreen/dataset/2"
_ARRAYS = tuple(field.name for field in fields(CaseBatch))


@dataclass(frozen=True)
class Dataset:
    """Cases and the κ of their first crossings.

    Infinite where there is none up to the design space's largest κ, NaN where it is not known.

    Attributes
    ----------
    cases
        m cases.
    kappa
        Shape (m,).
    provenance
        Where they come from: design space, seed, counts, method, code version.
    """

    cases: CaseBatch
    kappa: np.ndarray
    provenance: dict[str, Any]

    @property
    def digest(self) -> str:
        """SHA-256 of the arrays and their provenance."""
        h = hashlib.sha256(json.dumps(self.provenance, sort_keys=True).encode())
        for name, array in self._arrays().items():
            h.update(name.encode() + str(array.dtype).encode() + str(array.shape).encode())
            h.update(np.ascontiguousarray(array).tobytes())
        return h.hexdigest()

    def write(self, folder: Path) -> Path:
        """Write to `folder` under its digest; a dataset already there is left untouched."""
        path = folder / f"dataset-{self.digest[:16]}.npz"
        self.write_to(path)
        return path

    def write_to(self, path: Path) -> None:
        """Write under a name of one's own, whole or not at all; a file already there is left untouched."""
        path.parent.mkdir(parents=True, exist_ok=True)
        if not path.exists():
            buffer = io.BytesIO()
            header = json.dumps({"format": FORMAT, "digest": self.digest, "provenance": self.provenance})
            arrays: dict[str, Any] = {"header": np.frombuffer(header.encode(), np.uint8), **self._arrays()}
            np.savez_compressed(buffer, **arrays)
            partial = path.with_suffix(f".{os.getpid()}.partial")
            partial.write_bytes(buffer.getvalue())
            partial.replace(path)
            path.chmod(0o444)

    @classmethod
    def read(cls, path: Path) -> Dataset:
        """Read a dataset back.

        Raises
        ------
        InvalidInput
            When there is no such file.
        DamagedFile
            When it is cut short, altered or of another kind.
        """
        if not path.is_file():
            raise InvalidInput("dataset", str(path), "give a dataset file")
        try:
            with np.load(path, allow_pickle=False) as data:
                header = json.loads(bytes(data["header"]))
                cases = CaseBatch(*(data[name] for name in _ARRAYS))
                found = cls(cases, data["kappa"], header["provenance"])
        except Exception as error:  # zipfile and zlib raise their own kinds
            raise DamagedFile("dataset", str(path), f"it cannot be read ({error}); label again") from None
        if header.get("format") != FORMAT or found.digest != header.get("digest"):
            raise DamagedFile("dataset", str(path), "its checksum does not hold; label again")
        return found

    def _arrays(self) -> dict[str, np.ndarray]:
        return {**{name: getattr(self.cases, name) for name in _ARRAYS}, "kappa": self.kappa}


def kept_labels(cases: CaseBatch, folder: Path, label: Callable[[], np.ndarray]) -> np.ndarray:
    """κ of cases labelled before in this folder, else what `label` gives, kept for the next time.

    Labels are named after the cases and the version of the code, and no others are taken for them. Those that
    cannot be read are made again.
    """
    asked = Dataset(cases, np.zeros(0), {"labels of": FORMAT, "code_version": __version__})
    path = folder / f"labels-{asked.digest[:16]}.npz"
    if path.is_file():
        try:
            return Dataset.read(path).kappa
        except DamagedFile:
            path.unlink(missing_ok=True)
    found = Dataset(cases, label(), asked.provenance)
    found.write_to(path)
    return found.kappa
