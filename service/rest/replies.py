"""Answers on the wire and back: JSON (NaN as null) and npz."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
import orjson

from sdm_core.errors import DamagedFile
from service.rest.forms.npz_replies import packed
from training.answers import (
    BoundaryAnswers,
    CertificateUsed,
    MapAnswers,
    PointAnswers,
    SensitivityAnswers,
)

Json = dict[str, Any]

_TRUTH = np.array([False, True, None], dtype=object)
_POINT_FLOATS = (
    "unstable_probability",
    "spectral_radius",
    "growth_per_revolution",
    "chatter_hz",
    "error_estimate",
    "wear_lobes",
)
_BOUNDARY_FLOATS = ("critical_ke", "chatter_hz", "error_estimate")
_SENSITIVITY_FLOATS = (*_BOUNDARY_FLOATS, "value", "derivative", "relative")
_LABELS = ("source", "reason")
# What a map's question may choose among.
MAP_FIELDS = ("stable", "unstable_probability", *_LABELS)
_MAP_ARRAYS = ("speed_hz", "ke", *MAP_FIELDS)


def to_json(document: Json | None) -> bytes:
    """JSON in which every NaN, in numpy arrays too, is null."""
    return orjson.dumps(document, option=orjson.OPT_SERIALIZE_NUMPY)


def points_to_dict(answers: PointAnswers) -> Json:
    """The reply of ``POST /v1/stability``."""
    counts = [None if np.isnan(count) else int(count) for count in answers.unstable_multipliers]
    return {
        "stable": _truths(answers.stable),
        **_columns(answers, _POINT_FLOATS),
        "unstable_multipliers": counts,
        **_origin(answers),
    }


def points_from_dict(reply: Json, speed_hz: np.ndarray, ke: np.ndarray) -> PointAnswers:
    """The answers in a reply of ``POST /v1/stability``."""
    floats = _floats(reply, ("stable", *_POINT_FLOATS, "unstable_multipliers"))
    return PointAnswers(speed_hz=speed_hz, ke=ke, **floats, **_origin_from(reply))


def boundary_to_dict(answers: BoundaryAnswers) -> Json:
    """The reply of ``POST /v1/boundary``."""
    return {
        **_columns(answers, _BOUNDARY_FLOATS),
        "unstable_ke": answers.unstable_ke,
        **_origin(answers),
    }


def boundary_from_dict(reply: Json, speed_hz: np.ndarray, ke_max: float) -> BoundaryAnswers:
    """The answers in a reply of ``POST /v1/boundary``."""
    floats = _floats(reply, _BOUNDARY_FLOATS)
    intervals = tuple(
        None if found is None else tuple((float(low), float(high)) for low, high in found)
        for found in reply["unstable_ke"]
    )
    return BoundaryAnswers(
        speed_hz=speed_hz, ke_max=ke_max, unstable_ke=intervals, **floats, **_origin_from(reply)
    )


def sensitivities_to_dict(answers: SensitivityAnswers) -> Json:
    """The reply of ``POST /v1/sensitivities``."""
    return {
        **_columns(answers, _SENSITIVITY_FLOATS),
        "parameter": list(answers.parameter),
        "unit": list(answers.unit),
        **_origin(answers),
    }


def sensitivities_from_dict(reply: Json, speed_hz: np.ndarray, ke_max: float) -> SensitivityAnswers:
    """The answers in a reply of ``POST /v1/sensitivities``."""
    return SensitivityAnswers(
        speed_hz=speed_hz,
        ke_max=ke_max,
        parameter=tuple(reply["parameter"]),
        unit=tuple(reply["unit"]),
        **_floats(reply, _SENSITIVITY_FLOATS),
        **_origin_from(reply),
    )


def map_to_dict(answers: MapAnswers, fields: Sequence[str] = MAP_FIELDS) -> Json:
    """The reply of ``POST /v1/map``, with those of `MAP_FIELDS` that were asked for."""
    left_out = set(MAP_FIELDS) - set(fields)
    document = {
        **_columns(answers, ("speed_hz", "ke")),
        "stable": _truths(answers.stable) if "stable" in fields else None,
        **_columns(answers, ("unstable_probability",)),
        **_origin(answers),
        "exact_share": answers.exact_share,
        "unstable_share": answers.unstable_share,
    }
    return {name: value for name, value in document.items() if name not in left_out}


def map_from_dict(reply: Json) -> MapAnswers:
    """The answers in a reply of ``POST /v1/map``."""
    floats = _floats(reply, ("speed_hz", "ke", "stable", "unstable_probability"))
    return MapAnswers(**floats, **_origin_from(reply))


def map_to_npz(answers: MapAnswers, fields: Sequence[str] = MAP_FIELDS) -> bytes:
    """The map as a compressed npz: its arrays, `model` ('' for none), `solver`, and `certificate` as JSON.

    Parameters
    ----------
    fields
        Those of `MAP_FIELDS` that were asked for.
    """
    arrays: Json = {name: np.asarray(getattr(answers, name)) for name in ("speed_hz", "ke", *fields)}
    arrays |= {name: arrays[name].astype(str) for name in _LABELS if name in fields}
    arrays["model"], arrays["solver"] = np.array(answers.model or ""), np.array(answers.solver)
    arrays["certificate"] = np.array(to_json(_origin(answers)["certificate"]).decode())
    return packed(arrays)


def map_from_npz(content: bytes) -> MapAnswers:
    """The answers in the npz form of a map.

    Raises
    ------
    DamagedFile
        When it is not such a file.
    """
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as npz:
            arrays = {name: npz[name] for name in _MAP_ARRAYS}
            model, solver = str(npz["model"]), str(npz["solver"])
            said = str(npz["certificate"]) if "certificate" in npz else "null"
            certificate = _certificate_from(orjson.loads(said))
    except (ValueError, KeyError, TypeError, OSError, EOFError, zipfile.BadZipFile) as error:
        raise DamagedFile("map", f"{len(content)} bytes", f"ask for it again ({error})") from None
    return MapAnswers(**arrays, model=model or None, solver=solver, certificate=certificate)


def _truths(stable: np.ndarray) -> list:
    """1.0, 0.0 and NaN as true, false and null."""
    return _TRUTH[np.where(np.isnan(stable), 2, stable == 1.0).astype(int)].tolist()


def _columns(answers: Any, names: tuple[str, ...]) -> Json:
    return {name: np.ascontiguousarray(getattr(answers, name), dtype=float) for name in names}


def _origin(answers: PointAnswers | BoundaryAnswers | SensitivityAnswers | MapAnswers) -> Json:
    return {
        "source": answers.source.tolist(),
        "reason": answers.reason.tolist(),
        "model": answers.model,
        "solver": answers.solver,
        "certificate": None if answers.certificate is None else asdict(answers.certificate),
    }


def _origin_from(reply: Json) -> Json:
    labels = {name: np.array(reply[name], dtype=str) for name in _LABELS}
    return {
        **labels,
        "model": reply["model"],
        "solver": reply["solver"],
        "certificate": _certificate_from(reply.get("certificate")),
    }


def _certificate_from(data: Json | None) -> CertificateUsed | None:
    return None if data is None else CertificateUsed(**data)


def _floats(reply: Json, names: tuple[str, ...]) -> Json:
    return {name: np.array(reply[name], dtype=float) for name in names}  # None becomes NaN, true 1.0
