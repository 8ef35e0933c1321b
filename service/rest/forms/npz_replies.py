"""Answers as npz: what is null in JSON is NaN, and nothing needs a pickle.

Labels, of which there are a handful of kinds, are numbers into a list: ``source_labels[source]``.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import orjson

from sdm_core.errors import DamagedFile
from training.answers import CertificateUsed, PointAnswers, SensitivityAnswers

Json = dict[str, Any]
LABELS = ("source", "reason")
POINT_FLOATS = (
    "stable",
    "unstable_probability",
    "spectral_radius",
    "growth_per_revolution",
    "chatter_hz",
    "error_estimate",
    "unstable_multipliers",
    "wear_lobes",
)
_SENSITIVITY_FLOATS = ("critical_ke", "chatter_hz", "error_estimate", "value", "derivative", "relative")
# Columns the source does not compute are NaN throughout, and shrink to nothing at any level; the others
# hardly shrink at the highest.
_LEVEL = 1


def points_to_npz(answers: PointAnswers) -> bytes:
    """The reply of ``POST /v1/stability``; `stable` is 1, 0 or NaN."""
    return _packed(answers, POINT_FLOATS)


def points_from_npz(content: bytes, speed_hz: np.ndarray, ke: np.ndarray) -> PointAnswers:
    """The answers in it; DamagedFile when it is not such a file."""
    return PointAnswers(speed_hz=speed_hz, ke=ke, **_unpacked(content, "points", POINT_FLOATS))


def sensitivities_to_npz(answers: SensitivityAnswers) -> bytes:
    """The reply of ``POST /v1/sensitivities``: one row a speed, one column a parameter."""
    names = {"parameter": np.array(answers.parameter), "unit": np.array(answers.unit)}
    return _packed(answers, _SENSITIVITY_FLOATS, names)


def sensitivities_from_npz(content: bytes, speed_hz: np.ndarray, ke_max: float) -> SensitivityAnswers:
    """The answers in it; DamagedFile when it is not such a file."""
    found = _unpacked(content, "sensitivities", _SENSITIVITY_FLOATS, ("parameter", "unit"))
    return SensitivityAnswers(speed_hz=speed_hz, ke_max=ke_max, **found)


def coded(labels: np.ndarray, kinds: Sequence[str]) -> np.ndarray:
    """Each label's place among `kinds`, as int8."""
    codes = np.full(labels.shape, -1, dtype=np.int8)
    for i, kind in enumerate(kinds):
        codes[labels == kind] = i
    return codes


def kinds_of(labels: np.ndarray) -> list[str]:
    """The labels that occur, sorted."""
    # A set of a list is three times as fast as numpy's unique, which sorts every entry.
    return sorted({str(label) for label in set(labels.ravel().tolist())})


def _packed(
    answers: PointAnswers | SensitivityAnswers, floats: Sequence[str], more: Json | None = None
) -> bytes:
    arrays: Json = {name: np.ascontiguousarray(getattr(answers, name), dtype=float) for name in floats}
    for name in LABELS:
        labels = np.asarray(getattr(answers, name))
        kinds = kinds_of(labels)
        arrays |= {name: coded(labels, kinds), f"{name}_labels": np.array(kinds, dtype=str)}
    said = None if answers.certificate is None else asdict(answers.certificate)
    arrays |= {
        "model": np.array(answers.model or ""),
        "solver": np.array(answers.solver),
        "certificate": np.array(orjson.dumps(said).decode()),
        **(more or {}),
    }
    return packed(arrays)


def packed(arrays: Json) -> bytes:
    """Arrays as npz, at the level at which most of what shrinks has shrunk."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w") as file:
                np.lib.format.write_array(file, np.asarray(array), allow_pickle=False)
    return buffer.getvalue()


def _unpacked(content: bytes, what: str, floats: Sequence[str], texts: Sequence[str] = ()) -> Json:
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as npz:
            found: Json = {name: np.asarray(npz[name], dtype=float) for name in floats}
            found |= {name: npz[f"{name}_labels"][npz[name]] for name in LABELS}
            found |= {name: tuple(npz[name].tolist()) for name in texts}
            found |= {"model": str(npz["model"]) or None, "solver": str(npz["solver"])}
            said = orjson.loads(str(npz["certificate"]))
        return found | {"certificate": None if said is None else CertificateUsed(**said)}
    except (ValueError, KeyError, TypeError, IndexError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise DamagedFile(what, f"{len(content)} bytes", f"ask for it again ({error})") from None
