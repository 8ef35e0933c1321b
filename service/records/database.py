"""The database of the service: SQLite in the data folder by default, PostgreSQL by URL."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import Column, Connection, Engine, Integer, MetaData, Table, create_engine, event, text
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import (
    ArgumentError,
    DBAPIError,
    InterfaceError,
    NoSuchModuleError,
    OperationalError,
    SQLAlchemyError,
    TimeoutError,
)

from sdm_core.errors import InvalidInput
from service.records import shape

# Raised when a table changes in a way that rows written before do not fit. Columns are only ever added, and
# may be NULL: where a table is older than its newest column, that is added when the database is opened.
SCHEMA_VERSION = 1
FILE = "rubscreen.sqlite"
RESTORING = ".restoring"  # below a data folder while a backup is unpacked into it
_LOCK = 7_201_137  # any number, the same in every replica: PostgreSQL's advisory lock while tables are made

# Of connections to PostgreSQL: one that hangs is given up, like one that refuses (libpq's names; s, and ms
# for tcp_user_timeout).
PATIENCE: dict[str, int] = {
    "connect_timeout": 5,
    "tcp_user_timeout": 10_000,
    "keepalives_idle": 10,
    "keepalives_interval": 5,
}

METADATA = MetaData()
_VERSION = Table("rubscreen_schema", METADATA, Column("version", Integer, primary_key=True))


def database_url(url: str | None, data_folder: Path) -> URL:
    """Where the database is: the URL given, else a file of the data folder.

    Raises
    ------
    InvalidInput
        When it is neither of SQLite nor of PostgreSQL.

    Examples
    --------
    >>> str(database_url("postgresql://me@db/rub", Path("data")))
    'postgresql+psycopg://me@db/rub'
    """
    if url is None:
        return URL.create("sqlite", database=str((data_folder / FILE).resolve()))
    remedy = "give sqlite:///FILE or postgresql://USER:PASSWORD@HOST:PORT/DATABASE"
    try:
        parsed = make_url(url)
    except (ArgumentError, ValueError):
        raise InvalidInput("database_url", "not a URL", remedy) from None
    kind = parsed.drivername.partition("+")[0]
    if kind in ("postgresql", "postgres"):
        return parsed.set(drivername="postgresql+psycopg")
    if kind == "sqlite" and parsed.database not in (None, "", ":memory:"):
        return parsed
    raise InvalidInput("database_url", parsed.render_as_string(hide_password=True), remedy)


class Database:
    """Connections to the database, whose tables are made, or made complete, when it is opened.

    Raises
    ------
    InvalidInput
        When it cannot be reached, or was written by a later version.

    Examples
    --------
    >>> import tempfile
    >>> with Database(database_url(None, Path(tempfile.mkdtemp()))).begin() as connection:
    ...     connection.execute(text("select 1")).scalar()
    1
    """

    def __init__(self, url: URL) -> None:
        self.url = url
        self.engine = _engine(url)
        try:
            self._prepare()
        except (SQLAlchemyError, NoSuchModuleError) as error:
            self.engine.dispose()
            cause = str(getattr(error, "orig", None) or error).strip().splitlines()[0]
            raise InvalidInput("database_url", self.shown, f"it cannot be used ({cause}): mend it") from None

    @property
    def shown(self) -> str:
        """The URL without its password."""
        return self.url.render_as_string(hide_password=True)

    @property
    def shared(self) -> bool:
        """Whether several replicas may use it at the same time."""
        return self.url.drivername.startswith("postgresql")

    @contextmanager
    def begin(self) -> Iterator[Connection]:
        """A transaction: committed at the end of the block, rolled back when it raises."""
        with self.engine.begin() as connection:
            yield connection

    def answers(self) -> bool:
        """Whether it can be read and written now."""
        try:
            with self.begin() as connection:
                connection.execute(_VERSION.update().values(version=_VERSION.c.version))
        except OperationalError:
            return False
        return True

    def close(self) -> None:
        """Close the connections."""
        self.engine.dispose()

    def _prepare(self) -> None:
        with self.begin() as connection:
            if self.shared:  # replicas that start together would make the tables twice
                connection.execute(text("select pg_advisory_xact_lock(:key)"), {"key": _LOCK})
            METADATA.create_all(connection)
            found = connection.execute(_VERSION.select()).scalar()
            if found is None:
                connection.execute(_VERSION.insert().values(version=SCHEMA_VERSION))
            elif found > SCHEMA_VERSION:
                remedy = f"this program knows versions up to {SCHEMA_VERSION}: install a newer one"
                raise InvalidInput("database_url", f"{self.shown}, version {found}", remedy)
            short = shape.is_short(connection, METADATA)
            if short and self.shared:
                shape.complete(connection, METADATA)
        if short and not self.shared:
            with self.begin() as connection:
                # Python begins a transaction of SQLite with the first change of rows, which none is here.
                connection.exec_driver_sql("BEGIN IMMEDIATE")
                shape.complete(connection, METADATA)


def does_not_answer(error: SQLAlchemyError) -> bool:
    """Whether an error says that the database is away, hangs, is busy or full, and so may pass.

    Anything else is a fault of the question, which would fail again: text that it cannot hold, say.
    """
    if isinstance(error, OperationalError | InterfaceError | TimeoutError):
        return True
    return isinstance(error, DBAPIError) and error.connection_invalidated


def is_out_of_room(error: SQLAlchemyError) -> bool:
    """Whether the database has no room left on its disk."""
    cause = getattr(error, "orig", None)  # not the error's own text, which quotes what was asked
    disk_full = getattr(cause, "sqlstate", None) == "53100"  # PostgreSQL, appendix A
    return disk_full or "disk is full" in str(cause)


def open_database(data_folder: Path, url: str | None = None) -> Database:
    """The database of a data folder, which is made where it is not there yet.

    Raises
    ------
    InvalidInput
        When the folder cannot be made or is being restored, or the database cannot be used.
    """
    try:
        # Hashes of keys and blades lie there: nobody else on this machine need read them.
        data_folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    except OSError as error:
        remedy = f"it cannot be made ({error.strerror}): give another folder"
        raise InvalidInput("data_folder", str(data_folder), remedy) from None
    if (data_folder / RESTORING).exists():
        remedy = "a restore into it did not finish: empty it, and restore again"
        raise InvalidInput("data_folder", str(data_folder), remedy)
    return Database(database_url(url, data_folder))


def _engine(url: URL) -> Engine:
    if not url.drivername.startswith("sqlite"):
        # A connection that the server closed meanwhile is found out before it is used.
        patience = PATIENCE | {"options": "-c statement_timeout=30000"}
        return create_engine(url, pool_pre_ping=True, pool_size=5, max_overflow=15, connect_args=patience)
    engine = create_engine(url, connect_args={"timeout": 30.0})

    @event.listens_for(engine, "connect")
    def configure(connection, record) -> None:
        # With a write-ahead log readers go on while a job writes; FULL survives a power cut.
        connection.isolation_level = "IMMEDIATE"
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    return engine
