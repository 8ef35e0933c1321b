"""Answers as an Arrow IPC stream: the columns of the JSON form, null where that has null."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import orjson
import pyarrow as pa

from service.rest.forms.npz_replies import LABELS, POINT_FLOATS, coded, kinds_of
from training.answers import PointAnswers

_TYPES = {"stable": pa.bool_(), "unstable_multipliers": pa.int64()}
# Every Arrow library reads it, and columns of nulls alone are most of what is sent.
_COMPRESSION = "lz4"


def points_to_arrow(answers: PointAnswers) -> bytes:
    """The reply of ``POST /v1/stability``.

    `source` and `reason` are dictionary-encoded. The schema's metadata hold `rubscreen.solver`, and where
    they are not null `rubscreen.model` and, as JSON, `rubscreen.certificate`.
    """
    columns = {name: _floats(getattr(answers, name), _TYPES.get(name)) for name in POINT_FLOATS}
    columns |= {name: _labels(np.asarray(getattr(answers, name))) for name in LABELS}
    said = {"rubscreen.solver": answers.solver.encode()}
    if answers.model is not None:
        said["rubscreen.model"] = answers.model.encode()
    if answers.certificate is not None:
        said["rubscreen.certificate"] = orjson.dumps(asdict(answers.certificate))
    table = pa.table(columns).replace_schema_metadata(said)
    sink = pa.BufferOutputStream()
    options = pa.ipc.IpcWriteOptions(compression=_COMPRESSION)
    with pa.ipc.new_stream(sink, table.schema, options=options) as writer:
        writer.write_table(table)
    return sink.getvalue().to_pybytes()


def _floats(values: np.ndarray, kind: pa.DataType | None) -> pa.Array:
    array = pa.array(np.ascontiguousarray(values, dtype=float), from_pandas=True)  # NaN becomes null
    return array if kind is None else array.cast(kind)


def _labels(labels: np.ndarray) -> pa.Array:
    kinds = kinds_of(labels)
    return pa.DictionaryArray.from_arrays(pa.array(coded(labels, kinds)), pa.array(kinds))
