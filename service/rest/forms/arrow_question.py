"""A question as an Arrow IPC stream: columns `speed_hz` and `ke`, the rest as JSON in the metadata."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np
import pyarrow as pa

from sdm_core.errors import InvalidInput
from service.rest.body import parsed
from service.rest.forms.bulk_question import COLUMNS, QUESTION, joined
from service.rest.forms.flatbuffer import MESSAGE_HEADER, Table, TooMany
from service.settings import Settings
from service.sizes import TooLarge

METADATA_KEY = f"rubscreen.{QUESTION}".encode()
_REMEDY = "send what an Arrow stream writer writes: columns of numbers, uncompressed, closed at the end"
_END = b"\xff\xff\xff\xff\0\0\0\0"
_MOST_BATCHES = 4096
_MOST_COLUMNS, _MOST_METADATA = 8, 64
# Places in the tables of Arrow's format, Schema.fbs and Message.fbs.
_SCHEMA_FIELDS, _SCHEMA_METADATA = 1, 2
_FIELD_DICTIONARY, _FIELD_CHILDREN, _FIELD_METADATA = 4, 5, 6
_BATCH_COMPRESSION = 3


def arrow_question(body: bytes, settings: Settings) -> dict[str, Any]:
    """The question in an Arrow stream, as the JSON form would have it but with arrays of numbers.

    Columns are read where they lie in the body. Compressed ones are refused, because what they unpack to
    is only known when they are unpacked. An entry that is null is NaN here, which the check of the column
    then names.

    Raises
    ------
    InvalidInput
        Where it is no such stream, is damaged, or holds something else.
    TooLarge
        For more rows than `max_points`.
    """
    if not body.endswith(_END):
        raise InvalidInput("body", f"{len(body)} bytes of Arrow without an end", _REMEDY)
    try:
        schema, batches = _read(pa.py_buffer(body), settings)
        columns = {name: _column(schema, batches, name) for name in schema.names}
        text = (schema.metadata or {}).get(METADATA_KEY)
    except InvalidInput:
        raise
    except (pa.ArrowException, ValueError, KeyError, OSError, EOFError, MemoryError, struct.error) as error:
        said = " ".join(str(error).split())[:200] or type(error).__name__
        raise InvalidInput("body", f"{len(body)} bytes of Arrow", f"{_REMEDY} ({said})") from None
    if text is None:
        raise InvalidInput(
            METADATA_KEY.decode(), "missing", "give the question as JSON in the schema's metadata"
        )
    return joined(parsed(text), columns)


def _read(body: pa.Buffer, settings: Settings) -> tuple[pa.Schema, list[pa.RecordBatch]]:
    reader = pa.ipc.MessageReader.open_stream(body)
    try:
        first = reader.read_next_message()
    except StopIteration:
        raise InvalidInput("body", "an Arrow stream without a schema", _REMEDY) from None
    _check_schema(first)
    schema = pa.ipc.read_schema(first)
    for field in schema:
        if not (pa.types.is_integer(field.type) or pa.types.is_floating(field.type)):
            raise InvalidInput(field.name[:100], f"a column of {field.type}", "give real numbers")
    batches, rows = [], 0
    for message in reader:
        if message.type != "record batch" or _header(message).has(_BATCH_COMPRESSION):
            kind = "compressed" if message.type == "record batch" else message.type
            raise InvalidInput("body", f"an Arrow message: {kind}", _REMEDY)
        batch = pa.ipc.read_record_batch(message, schema)
        batch.validate(full=True)
        batches.append(batch)
        rows += batch.num_rows
        if rows > settings.max_points:
            remedy = f"give at most {settings.max_points}, or split the request"
            raise TooLarge(COLUMNS[0], f"over {settings.max_points} entries", remedy)
        if len(batches) > _MOST_BATCHES:
            raise InvalidInput("body", f"over {_MOST_BATCHES} Arrow batches", "write longer batches")
    return schema, batches


def _column(schema: pa.Schema, batches: list[pa.RecordBatch], name: str) -> np.ndarray:
    i = schema.get_field_index(name)
    if i < 0:
        raise InvalidInput(name[:100], "two columns of one name", "give each column once")
    parts = [batch.column(i).to_numpy(zero_copy_only=False) for batch in batches]
    return np.concatenate(parts) if parts else np.empty(0)


def _header(message: pa.Message) -> Table:
    return Table.root(message.metadata.to_pybytes()).table(MESSAGE_HEADER)


def _check_schema(message: pa.Message) -> None:
    """Refuse a schema of many fields, which cost far more memory read than sent, before it is read."""
    if message.type != "schema":
        raise InvalidInput("body", f"an Arrow stream that starts with a {message.type}", _REMEDY)
    try:
        schema = _header(message)
        schema.tables(_SCHEMA_METADATA, _MOST_METADATA)
        for field in schema.tables(_SCHEMA_FIELDS, _MOST_COLUMNS):
            field.tables(_FIELD_METADATA, _MOST_METADATA)
            field.tables(_FIELD_CHILDREN, 0)
            if field.has(_FIELD_DICTIONARY):
                raise InvalidInput("body", "an Arrow column with a dictionary", "give real numbers")
    except TooMany as error:
        raise InvalidInput("body", f"an Arrow schema with {error}", _REMEDY) from None
