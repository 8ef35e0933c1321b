"""What is stored of a chunk: its results, as numpy arrays with one JSON text, in an npz without pickles.

The bytes depend on the results alone, so that the same chunk computed twice is the same file.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import orjson

from sdm_core.blade import Blade, blade_from_dict, blade_to_dict
from sdm_core.contact import ContactConfiguration
from sdm_core.errors import DamagedFile
from sdm_core.lobe_tips import CriticalSpeed
from service.screening.screen import ScreeningResult
from training.answers import (
    CONFIDENT,
    EXACT,
    NEAR_BOUNDARY,
    OUT_OF_DOMAIN,
    REQUESTED,
    SURROGATE,
    BoundaryAnswers,
    CertificateUsed,
    MapAnswers,
)

_SOURCES = (SURROGATE, EXACT)
_REASONS = (CONFIDENT, NEAR_BOUNDARY, OUT_OF_DOMAIN, REQUESTED)
_META = "content"
_CURVES = ("speed_hz", "critical_ke", "chatter_hz", "error_estimate")


@dataclass(frozen=True)
class ScreenedBlade:
    """A blade of the job that was screened.

    Attributes
    ----------
    index, source
        As of `BladeLine`.
    results
        One a contact, in the order asked.
    """

    index: int
    source: str
    blade: Blade
    results: tuple[ScreeningResult, ...]


@dataclass(frozen=True)
class UnscreenedBlade:
    """A blade of the job that could not be screened, and why in a line."""

    index: int
    source: str
    name: str
    reason: str


@dataclass(frozen=True)
class ChunkContent:
    """The outcome of a chunk: every one of its blades is in one of the two."""

    screened: tuple[ScreenedBlade, ...]
    unscreened: tuple[UnscreenedBlade, ...]

    @classmethod
    def joined(cls, parts: Sequence[ChunkContent]) -> ChunkContent:
        """Several as one, blades in the order of the job."""
        screened = sorted((b for part in parts for b in part.screened), key=lambda b: b.index)
        unscreened = sorted((b for part in parts for b in part.unscreened), key=lambda b: b.index)
        return cls(tuple(screened), tuple(unscreened))

    def to_bytes(self) -> bytes:
        """The npz."""
        arrays: dict[str, np.ndarray] = {}
        blades = []
        for screened in self.screened:
            results = [
                _packed(result, f"{screened.index}/{j}", arrays) for j, result in enumerate(screened.results)
            ]
            document = blade_to_dict(screened.blade)
            blades.append(
                {"index": screened.index, "source": screened.source, "blade": document, "results": results}
            )
        meta = {"screened": blades, "unscreened": [asdict(blade) for blade in self.unscreened]}
        arrays[_META] = np.frombuffer(json.dumps(meta).encode(), dtype=np.uint8)
        buffer = io.BytesIO()
        np.savez_compressed(buffer, allow_pickle=False, **arrays)
        return buffer.getvalue()

    @classmethod
    def from_bytes(cls, content: bytes, blade_index: int | None = None) -> ChunkContent:
        """Read back; with `blade_index` that one blade only.

        Raises
        ------
        DamagedFile
            When it is not what was written.
        """
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as npz:
                meta = json.loads(npz[_META].tobytes())
                screened = tuple(
                    _screened(entry, npz)
                    for entry in meta["screened"]
                    if blade_index is None or entry["index"] == blade_index
                )
        except (ValueError, KeyError, TypeError, IndexError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise DamagedFile("chunk", f"{len(content)} bytes", f"it is computed again ({error})") from None
        return cls(screened, tuple(UnscreenedBlade(**entry) for entry in meta["unscreened"]))


def rows_of(content: bytes) -> tuple[list[dict[str, Any]], list[UnscreenedBlade]]:
    """The rows of the ranking in a chunk, and its blades that were not screened; charts are not read.

    Raises
    ------
    DamagedFile
        When it is not what was written.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as npz:
            meta = _meta(npz[_META].tobytes())
        rows = [
            {"blade_index": entry["index"], "source": entry["source"], **result["row"]}
            for entry in meta["screened"]
            for result in entry["results"]
        ]
        return rows, [UnscreenedBlade(**entry) for entry in meta["unscreened"]]
    except (ValueError, KeyError, TypeError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise DamagedFile("chunk", f"{len(content)} bytes", f"it is computed again ({error})") from None


def _meta(text: bytes) -> dict[str, Any]:
    """Four times as fast as `json` where it can: infinite error estimates are no JSON to orjson."""
    try:
        return orjson.loads(text)
    except ValueError:
        return json.loads(text)


def _packed(result: ScreeningResult, place: str, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    sweep, chart = result.boundary, result.map
    for name in _CURVES:
        arrays[f"{place}/boundary/{name}"] = np.asarray(getattr(sweep, name), dtype=float)
    arrays[f"{place}/map/speed_hz"], arrays[f"{place}/map/ke"] = chart.speed_hz, chart.ke
    arrays[f"{place}/map/stable"] = np.where(np.isnan(chart.stable), 2, chart.stable).astype(np.uint8)
    # Three digits are more than a probability of a network has.
    arrays[f"{place}/map/unstable_probability"] = chart.unstable_probability.astype(np.float16)
    for kind, answers in (("boundary", sweep), ("map", chart)):
        arrays[f"{place}/{kind}/source"] = _coded(answers.source, _SOURCES)
        arrays[f"{place}/{kind}/reason"] = _coded(answers.reason, _REASONS)
    row = {**result.to_dict(), "model": chart.model, "solver": sweep.solver}
    return {
        "row": row,
        "contact_name": result.contact_name,
        "contact": result.contact.to_dict(),
        "speed_range_hz": list(result.speed_range_hz),
        "tips": [asdict(tip) for tip in result.critical_speeds],
        "ke_max": result.ke_max,
        "ke_liner": result.ke_liner,
        "shares": [result.unstable_share, result.verified_share],
        "boundary": {"ke_max": sweep.ke_max, "unstable_ke": sweep.unstable_ke, **_origin(sweep)},
        "map": _origin(chart),
    }


def _screened(entry: dict[str, Any], npz: Any) -> ScreenedBlade:
    blade = blade_from_dict(entry["blade"])
    results = tuple(
        _unpacked(blade, data, f"{entry['index']}/{j}", npz) for j, data in enumerate(entry["results"])
    )
    return ScreenedBlade(entry["index"], entry["source"], blade, results)


def _unpacked(blade: Blade, data: dict[str, Any], place: str, npz: Any) -> ScreeningResult:
    def labels(kind: str, name: str) -> np.ndarray:
        known = _SOURCES if name == "source" else _REASONS
        return np.array(known)[npz[f"{place}/{kind}/{name}"]]

    said = data["boundary"]
    intervals = tuple(
        None if found is None else tuple((float(low), float(high)) for low, high in found)
        for found in said["unstable_ke"]
    )
    sweep = BoundaryAnswers(
        **{name: npz[f"{place}/boundary/{name}"] for name in _CURVES},
        ke_max=said["ke_max"],
        unstable_ke=intervals,
        source=labels("boundary", "source"),
        reason=labels("boundary", "reason"),
        **_origin_from(said),
    )
    stable = npz[f"{place}/map/stable"]
    chart = MapAnswers(
        speed_hz=npz[f"{place}/map/speed_hz"],
        ke=npz[f"{place}/map/ke"],
        stable=np.where(stable == 2, np.nan, stable.astype(float)),
        unstable_probability=npz[f"{place}/map/unstable_probability"].astype(float),
        source=labels("map", "source"),
        reason=labels("map", "reason"),
        **_origin_from(data["map"]),
    )
    return ScreeningResult(
        blade=blade,
        contact_name=data["contact_name"],
        contact=ContactConfiguration.from_dict(data["contact"]),
        speed_range_hz=(data["speed_range_hz"][0], data["speed_range_hz"][1]),
        critical_speeds=tuple(CriticalSpeed(**tip) for tip in data["tips"]),
        ke_max=data["ke_max"],
        ke_liner=data["ke_liner"],
        unstable_share=data["shares"][0],
        verified_share=data["shares"][1],
        boundary=sweep,
        map=chart,
    )


def _coded(labels: np.ndarray, known: Sequence[str]) -> np.ndarray:
    codes = np.full(labels.shape, len(known), dtype=np.uint8)
    for code, label in enumerate(known):
        codes[labels == label] = code
    if (codes == len(known)).any():
        raise ValueError(f"labels other than {', '.join(known)}")
    return codes


def _origin(answers: BoundaryAnswers | MapAnswers) -> dict[str, Any]:
    used = answers.certificate
    return {
        "model": answers.model,
        "solver": answers.solver,
        "certificate": None if used is None else asdict(used),
    }


def _origin_from(data: dict[str, Any]) -> dict[str, Any]:
    used = data["certificate"]
    return {
        "model": data["model"],
        "solver": data["solver"],
        "certificate": None if used is None else CertificateUsed(**used),
    }
