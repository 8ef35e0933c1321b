"""Blades read lately: the same JSON again is the same blade, and need not be checked a second time."""

from __future__ import annotations

import marshal
from collections import OrderedDict
from threading import Lock
from typing import Any

from sdm_core.blade import Blade, blade_from_dict


class KnownBlades:
    """Reads blades from parsed JSON, and knows the last ones again.

    Blades are immutable, so that one object may answer in several threads.

    Parameters
    ----------
    most_bytes
        What is kept at most, by the length of the JSON values; a blade takes a few times as much.

    Examples
    --------
    >>> from sdm_core.blade import blade_to_dict, load_blade
    >>> known, document = KnownBlades(), blade_to_dict(load_blade("nasa_rotor_37"))
    >>> known.blade(document) is known.blade({**document})
    True
    """

    def __init__(self, most_bytes: int = 16 * 2**20) -> None:
        self._most = most_bytes
        self._blades: OrderedDict[bytes, Blade] = OrderedDict()
        self._size = 0
        self._lock = Lock()

    def blade(self, document: dict[str, Any]) -> Blade:
        """The blade of a parsed blade file.

        Raises
        ------
        InvalidInput
            As `blade_from_dict`; what is no blade is not kept.
        """
        key = _key(document)
        if key is None or len(key) > self._most // 16:
            return blade_from_dict(document)
        with self._lock:
            known = self._blades.get(key)
            if known is not None:
                self._blades.move_to_end(key)
                return known
        blade = blade_from_dict(document)
        with self._lock:
            if key not in self._blades:
                self._blades[key] = blade
                self._size += len(key)
            while self._size > self._most:
                self._size -= len(self._blades.popitem(last=False)[0])
        return blade


def _key(document: dict[str, Any]) -> bytes | None:
    """Bytes that are equal only for equal JSON values; None for what is not all of JSON."""
    # Format 2 knows no references, so that equal values give equal bytes; and 1, 1.0, True differ in them.
    # Arrays (of npz and Arrow bodies) would be written without their type.
    if not _all_json(document):
        return None
    return marshal.dumps(document, 2)


def _all_json(value: Any) -> bool:
    kind = type(value)
    if kind is dict:
        return all(map(_all_json, value.values()))
    if kind is list:
        # Rows of numbers, which nearly all of a blade is, at once.
        kinds = set(map(type, value))
        return kinds <= _SCALARS or all(map(_all_json, value))
    return kind in _SCALARS


_SCALARS = {str, int, float, bool, type(None)}
