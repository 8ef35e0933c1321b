"""The smallest PNG of a map of verdicts: a byte a cell, compressed."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence

import numpy as np


def indexed_png(shades: np.ndarray, palette: Sequence[tuple[int, int, int]]) -> bytes:
    """A PNG (ISO/IEC 15948) of places in a palette, the first row on top.

    Parameters
    ----------
    shades
        Whole numbers from 0 to below the number of colours, shape (rows, columns).
    palette
        Red, green and blue from 0 to 255, at most 256 colours.

    Examples
    --------
    >>> indexed_png(np.array([[0, 1]]), [(255, 255, 255), (0, 0, 0)])[:4]
    b'\\x89PNG'
    """
    rows, columns = shades.shape
    # Colour type 3 (palette), 8 bits; every row begins with its filter, 0: none.
    lines = np.zeros((rows, columns + 1), dtype=np.uint8)
    lines[:, 1:] = shades
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 3, 0, 0, 0)),
        (b"PLTE", bytes(level for colour in palette for level in colour)),
        (b"IDAT", zlib.compress(lines.tobytes(), 9)),
        (b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
        for kind, content in chunks
    )
