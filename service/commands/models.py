"""`rubscreen models`: the surrogates there are."""

from __future__ import annotations

from typing import Any

from service.commands.options import JsonOption, ModelsOption, UrlOption


def run(models: ModelsOption = None, url: UrlOption = None, json: JsonOption = None) -> None:
    """List the surrogates of a folder, or of a running service, the active one marked."""
    from rich.table import Table

    from service.commands.outputs import check_writable, console_beside, write_json

    check_writable(json=json)
    entries = _of_service(url) if url else _of_folder(models)
    console = console_beside(json)
    table = Table(title="Models", title_justify="left", title_style="bold")
    for heading in ("", "id", "trained on", "median boundary error", "false stable, auto"):
        table.add_column(heading, no_wrap=heading == "id")
    for entry in entries:
        table.add_row("active" if entry["active"] else "", entry["id"], *_figures(entry["card"]))
    console.print(table if entries else "no models: train one with `rubscreen train`")
    if json:
        write_json(json, {"models": entries}, indent=True)


def _of_folder(folder: str | None) -> list[dict[str, Any]]:
    from pathlib import Path

    from sdm_core.errors import InvalidInput
    from training.registry import SHIPPED, list_models

    if folder is not None and not Path(folder).is_dir():
        raise InvalidInput("--models", folder, "give a folder of models")
    found = list_models(SHIPPED if folder is None else Path(folder))
    return [{"id": entry.id, "active": entry.active, "card": entry.card} for entry in found]


def _of_service(url: str) -> list[dict[str, Any]]:
    from service.client import Client

    with Client(url) as client:
        return client.models()


def _figures(card: dict[str, Any]) -> tuple[str, str, str]:
    """What a card says of itself; a card of another age may say less."""
    dataset, evaluation = card.get("dataset", {}), card.get("evaluation", {})
    size = f"{dataset['designs']:,} blades" if "designs" in dataset else "-"
    error = f"{evaluation['median_boundary_error']:.2%}" if "median_boundary_error" in evaluation else "-"
    auto = evaluation.get("auto", {})
    wrong = f"{auto['false_stable']} of {auto['answered_stable']:,}" if "false_stable" in auto else "-"
    return size, error, wrong
