"""Tables of an older version brought to the shape this one knows: columns and indexes are only ever added."""

from __future__ import annotations

from sqlalchemy import Column, Connection, Index, MetaData, Table, inspect
from sqlalchemy.schema import CreateColumn

from sdm_core.errors import InvalidInput


def is_short(connection: Connection, metadata: MetaData) -> bool:
    """Whether a table of the database lacks a column or an index."""
    return any(_missing(connection, table) != ([], []) for table in metadata.sorted_tables)


def complete(connection: Connection, metadata: MetaData) -> None:
    """Add the columns and indexes that tables of the database lack; rows written before hold NULL there.

    Programs of the older version go on beside: they name the columns they know.

    Raises
    ------
    InvalidInput
        For a column that rows without it cannot have: nothing is changed then.
    """
    lacking = [(table, *_missing(connection, table)) for table in metadata.sorted_tables]
    for table, columns, _ in lacking:
        for column in columns:
            if not column.nullable and column.server_default is None:
                found = f"{table.name} without {column.name}"
                raise InvalidInput("database_url", found, "it is of a version too old: restore a backup")
    name = connection.dialect.identifier_preparer.format_table
    for table, columns, indexes in lacking:
        for column in columns:
            kind = CreateColumn(column).compile(dialect=connection.dialect)
            connection.exec_driver_sql(f"ALTER TABLE {name(table)} ADD COLUMN {kind}")
        for index in indexes:
            index.create(connection)


def _missing(connection: Connection, table: Table) -> tuple[list[Column], list[Index]]:
    inspector = inspect(connection)
    there = {column["name"] for column in inspector.get_columns(table.name)}
    indexed = {index["name"] for index in inspector.get_indexes(table.name)}
    columns = [column for column in table.columns if column.name not in there]
    return columns, [index for index in table.indexes if index.name not in indexed]
