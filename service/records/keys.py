"""API keys: who may call the service, and how much. Only a hash of each secret is stored.

A key reads ``rub_<id>_<secret>``. The id, 12 hexadecimal digits, is public: it finds the row and stands in
lists and logs. The secret is 256 random bits. A slow password hash would protect what people choose, by
making each guess expensive; nobody guesses 2^256, so one SHA-256 is enough, and it costs a microsecond where
a slow one would cost every request a tenth of a second.
"""

from __future__ import annotations

import hashlib
import hmac
import re
import secrets
import time
from dataclasses import dataclass, replace
from typing import Literal

from sqlalchemy import Column, Double, Integer, LargeBinary, RowMapping, String, Table, or_

from sdm_core.errors import InvalidInput
from service.records.database import METADATA, Database
from service.roles import Role

# A key's last use is written when the one on record is this old, s: not with every request.
LAST_USE_EVERY_S = 60.0
LONGEST_NAME = 200

KEYS = Table(
    "rubscreen_keys",
    METADATA,
    Column("id", String(12), primary_key=True),
    Column("name", String(LONGEST_NAME), nullable=False),
    Column("role", String(10), nullable=False),
    Column("secret_sha256", LargeBinary(32), nullable=False),
    Column("created_at", Double, nullable=False),  # these four: seconds since 1970, UTC
    Column("expires_at", Double),
    Column("revoked_at", Double),
    Column("last_used_at", Double),
    Column("requests_per_minute", Integer),
    Column("max_concurrent_requests", Integer),
    Column("max_active_jobs", Integer),
)

_KEY = re.compile(r"rub_([0-9a-f]{12})_([0-9a-f]{64})")


@dataclass(frozen=True)
class KeyLimits:
    """What one key may use; None is as the service's settings say.

    Attributes
    ----------
    requests_per_minute
        Requests in a minute, on each replica.
    max_concurrent_requests
        Requests answered at the same time, on each replica.
    max_active_jobs
        Jobs that wait or run, in all.

    Raises
    ------
    InvalidInput
        When one is below 1.
    """

    requests_per_minute: int | None = None
    max_concurrent_requests: int | None = None
    max_active_jobs: int | None = None

    def __post_init__(self) -> None:
        for field, value in vars(self).items():
            if value is not None and not 1 <= value < 2**31:
                raise InvalidInput(field, value, "give 1 or more, or revoke the key")


@dataclass(frozen=True)
class ApiKey:
    """A key on record; its secret is not.

    Attributes
    ----------
    id
        The public part of the key.
    name
        Of the person or the tool that has it; several keys may have one name, so that one can replace
        another.
    secret_sha256
        Hash of the secret, 32 bytes.
    created_at, expires_at, revoked_at, last_used_at
        Seconds since 1970, UTC; None for never.
    """

    id: str
    name: str
    role: Role
    secret_sha256: bytes
    created_at: float
    expires_at: float | None = None
    revoked_at: float | None = None
    last_used_at: float | None = None
    limits: KeyLimits = KeyLimits()

    def opened_by(self, secret: str) -> bool:
        """Whether `secret` is the key's, in a time that does not tell how much of it is right."""
        return hmac.compare_digest(_hash(secret), self.secret_sha256)

    def state(self, at: float) -> Literal["usable", "expired", "revoked"]:
        """Whether it could be used at a time, s since 1970."""
        if self.revoked_at is not None:
            return "revoked"
        return "expired" if self.expires_at is not None and self.expires_at <= at else "usable"


def split_key(text: str) -> tuple[str, str] | None:
    """Id and secret of a key; None when it is no whole key.

    Examples
    --------
    >>> split_key("rub_0123456789ab_" + 64 * "0") == ("0123456789ab", 64 * "0")
    True
    >>> split_key("rub_0123456789ab_0") is None
    True
    """
    found = _KEY.fullmatch(text)
    return None if found is None else (found[1], found[2])


class KeyStore:
    """The keys of a database.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from service.records.database import open_database
    >>> store = KeyStore(open_database(Path(tempfile.mkdtemp())))
    >>> key, text = store.create("design office", Role.submit)
    >>> store.find(split_key(text)[0]).opened_by(split_key(text)[1])
    True
    """

    def __init__(self, database: Database) -> None:
        self._database = database

    def create(
        self, name: str, role: Role, expires_at: float | None = None, limits: KeyLimits | None = None
    ) -> tuple[ApiKey, str]:
        """A new key, and its text, which nothing can give a second time.

        Raises
        ------
        InvalidInput
            When the name is empty, too long or not printable, or the expiry has passed.
        """
        name = name.strip()
        if not name or len(name) > LONGEST_NAME or not name.isprintable():
            raise InvalidInput("name", name, f"give 1 to {LONGEST_NAME} printable characters")
        now = time.time()
        if expires_at is not None and expires_at <= now:
            raise InvalidInput("expires_at", expires_at, "give a time to come")
        key_id, secret = secrets.token_hex(6), secrets.token_hex(32)
        key = ApiKey(key_id, name, role, _hash(secret), now, expires_at, limits=limits or KeyLimits())
        row = vars(key) | vars(key.limits)
        with self._database.begin() as connection:
            connection.execute(KEYS.insert().values({column.name: row[column.name] for column in KEYS.c}))
        return key, f"rub_{key_id}_{secret}"

    def find(self, key_id: str) -> ApiKey | None:
        """The key of that id, usable or not; None when there is none."""
        with self._database.begin() as connection:
            row = connection.execute(KEYS.select().where(KEYS.c.id == key_id)).mappings().one_or_none()
        return None if row is None else _read(row)

    def all(self) -> list[ApiKey]:
        """Every key, the oldest first."""
        with self._database.begin() as connection:
            rows = connection.execute(KEYS.select().order_by(KEYS.c.created_at, KEYS.c.id)).mappings().all()
        return [_read(row) for row in rows]

    def any_usable(self) -> bool:
        """Whether anybody can get in now."""
        now = time.time()
        return any(key.state(now) == "usable" for key in self.all())

    def revoke(self, key_id: str) -> ApiKey:
        """The key, from now on of no use; one revoked before keeps its time.

        Raises
        ------
        InvalidInput
            When there is no such key.
        """
        key = self.find(key_id)
        if key is None:
            raise InvalidInput("ID", key_id, "give the id of a key, as `rubscreen keys list` shows it")
        if key.revoked_at is not None:
            return key
        now = time.time()
        with self._database.begin() as connection:
            connection.execute(KEYS.update().where(KEYS.c.id == key_id).values(revoked_at=now))
        return replace(key, revoked_at=now)

    def used(self, key_id: str, at: float) -> None:
        """Put a use on record, unless one of the last minute is there already, by whatever replica."""
        recent = or_(KEYS.c.last_used_at.is_(None), KEYS.c.last_used_at <= at - LAST_USE_EVERY_S)
        with self._database.begin() as connection:
            connection.execute(KEYS.update().where(KEYS.c.id == key_id, recent).values(last_used_at=at))


def _hash(secret: str) -> bytes:
    return hashlib.sha256(secret.encode()).digest()


def _read(row: RowMapping) -> ApiKey:
    limits = KeyLimits(row["requests_per_minute"], row["max_concurrent_requests"], row["max_active_jobs"])
    return ApiKey(
        row["id"],
        row["name"],
        Role(row["role"]),
        bytes(row["secret_sha256"]),
        row["created_at"],
        row["expires_at"],
        row["revoked_at"],
        row["last_used_at"],
        limits,
    )
