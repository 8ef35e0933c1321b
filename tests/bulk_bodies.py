"""Questions in their binary forms, written the way a user would write them."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
import pyarrow as pa

from service.rest.forms.media_types import ARROW, NPZ

Json = dict[str, Any]


def split(question: Json) -> tuple[Json, dict[str, np.ndarray]]:
    """A question without its arrays, and the arrays."""
    columns = {name: np.array(question[name], dtype=float) for name in ("speed_hz", "ke") if name in question}
    return {key: value for key, value in question.items() if key not in columns}, columns


def to_npz(asked: Json, /, *, compressed: bool = False, **arrays: Any) -> bytes:
    """With further arrays, or others in their place."""
    rest, columns = split(asked)
    buffer = io.BytesIO()
    save = np.savez_compressed if compressed else np.savez
    save(buffer, **({"question": np.array(json.dumps(rest))} | columns | arrays))
    return buffer.getvalue()


def to_arrow(asked: Json, /, *, batch: int = 1000, compression: str | None = None, **columns: Any) -> bytes:
    """With further columns, or others in their place."""
    rest, plain = split(asked)
    table = pa.table(plain | columns).replace_schema_metadata({"rubscreen.question": json.dumps(rest)})
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression=compression)
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table, max_chunksize=batch)
    return sink.getvalue().to_pybytes()


FORMS = {NPZ: to_npz, ARROW: to_arrow}
