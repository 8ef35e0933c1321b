"""Whether `rubscreen serve` may start as it is told: open to everybody who reaches it, or with keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from service.settings import Settings


def settled(settings: Settings, host: str, address: str, *, open_to_all: bool) -> Settings:
    """The settings with the question of keys settled for the address that is listened on.

    Parameters
    ----------
    host
        As typed.
    address
        What it stands for: that of the bound socket.
    open_to_all
        Whether to ask for no keys wherever it is.

    Raises
    ------
    InvalidInput
        When keys are to be asked for and nobody has one.
    """
    from sdm_core.errors import InvalidInput
    from service.rest.loopback import is_loopback

    if open_to_all:
        if settings.auth == "on":
            raise InvalidInput("--open", "with RUBSCREEN_AUTH=on", "leave out one of them")
        settings = settings.model_copy(update={"auth": "off"})
    alone = is_loopback(address)
    if settings.auth == "off" and not alone:
        typer.echo(
            f"rubscreen: warning: whoever reaches {address} may do everything: no keys are asked for",
            err=True,
        )
    if settings.auth == "off" or (settings.auth == "auto" and alone):
        return settings
    if not _any_usable_key(settings):
        create = f"`rubscreen keys create NAME --role admin --data {settings.data_folder}`"
        if settings.auth == "on":
            raise InvalidInput("RUBSCREEN_AUTH", "on", f"no key is usable: make one with {create}")
        remedy = f"keys are asked for there and none is usable: make one with {create}, or give --open"
        raise InvalidInput("--host", host, remedy)
    return settings.model_copy(update={"auth": "on"})


def _any_usable_key(settings: Settings) -> bool:
    from service.records.database import open_database
    from service.records.keys import KeyStore

    assert settings.data_folder is not None
    database = open_database(settings.data_folder, settings.database_url)
    try:
        return KeyStore(database).any_usable()
    finally:
        database.close()
