"""As much of the FlatBuffers format as it takes to look into an Arrow message before Arrow reads it.

A table starts with the distance back to its vtable; the vtable holds its own length, the table's length, and
for each field its place in the table or 0 (FlatBuffers internals, "Tables" and "Vectors").
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Self

MESSAGE_HEADER = 2


class TooMany(ValueError):
    """A vector of more entries than anybody needs."""


@dataclass(frozen=True)
class Table:
    """A table of a buffer; reads outside the buffer raise `struct.error`."""

    buffer: bytes
    start: int

    @classmethod
    def root(cls, buffer: bytes) -> Self:
        """The table the buffer is about."""
        return cls(buffer, _number("<I", buffer, 0))

    def has(self, field: int) -> bool:
        """Whether the field is there."""
        return self._place(field) is not None

    def table(self, field: int) -> Table:
        """The table a field refers to; ValueError where the field is not there."""
        place = self._place(field)
        if place is None:
            raise ValueError("a message without a header")
        return Table(self.buffer, place + _number("<I", self.buffer, place))

    def tables(self, field: int, most: int) -> list[Table]:
        """The tables of a vector; none where the field is not there.

        Raises
        ------
        TooMany
            For more than `most`.
        """
        place = self._place(field)
        if place is None:
            return []
        vector = place + _number("<I", self.buffer, place)
        count = _number("<I", self.buffer, vector)
        if count > most:
            raise TooMany(f"{count} entries where {most} would do")
        places = [vector + 4 + 4 * i for i in range(count)]
        return [Table(self.buffer, place + _number("<I", self.buffer, place)) for place in places]

    def _place(self, field: int) -> int | None:
        vtable = self.start - _number("<i", self.buffer, self.start)
        entry = 4 + 2 * field
        if entry + 2 > _number("<H", self.buffer, vtable):
            return None
        offset = _number("<H", self.buffer, vtable + entry)
        return self.start + offset if offset else None


def _number(kind: str, buffer: bytes, place: int) -> int:
    if place < 0:  # struct would count from the end
        raise struct.error("outside the buffer")
    return int(struct.unpack_from(kind, buffer, place)[0])
