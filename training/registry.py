"""Model files: safetensors and a JSON card in a folder named after their content."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import safetensors.torch
from safetensors import SafetensorError

from sdm_core.errors import DamagedFile, InvalidInput
from sdm_core.whole_files import staged
from training.activation import ACTIVE, FIRST, SHIPPED, activate, active_id
from training.certificate import Certificate
from training.design_space import DesignSpace
from training.features import feature_names
from training.surrogate import Architecture, BoundaryNetwork, Surrogate

FORMAT = "rubscreen/model/2"
# Cards before certificates of several rates: their weights are as good, once they are recalibrated.
_UNCERTIFIED_FORMAT = "rubscreen/model/1"
_LONGEST_ID = 64
_WEIGHTS, _CARD = "model.safetensors", "card.json"


@dataclass(frozen=True)
class Model:
    """Everything needed to answer: network, domain, certificates, card."""

    id: str
    surrogate: Surrogate
    design_space: DesignSpace
    certificates: tuple[Certificate, ...]
    card: dict[str, Any]

    def certificate(self, contact: str) -> Certificate | None:
        """The certificate served for a class of contact, the card's first of it; None where there is none."""
        return next((found for found in self.certificates if found.contact == contact), None)


@dataclass(frozen=True)
class ModelEntry:
    """A line of the model list; a damaged model has no card and says what is wrong with it."""

    id: str
    active: bool
    card: dict[str, Any]
    damage: str | None = None


def write_model(
    surrogate: Surrogate,
    design_space: DesignSpace,
    certificates: Sequence[Certificate],
    card: dict[str, Any],
    folder: Path = SHIPPED,
    *,
    activate_first: bool = True,
) -> Model:
    """Write a model into its own folder under `folder`, whole or not at all.

    The identifier is the hash of weights and card, so a model never changes under its name. Where the same
    model lies already and is damaged, it is mended.

    Parameters
    ----------
    activate_first
        Make it active where the folder has no active model yet. An active model is replaced by
        `training.promotion` alone, which compares the two.

    Raises
    ------
    InvalidInput
        When the folder cannot be written; what lay there stays as it was.
    """
    weights = safetensors.torch.save(surrogate.network.state_dict())
    full = {
        "format": FORMAT,
        **card,
        "architecture": surrogate.architecture.to_dict(),
        "features": list(feature_names()),
        "design_space": design_space.to_dict(),
        "certificates": [certificate.to_dict() for certificate in certificates],
        "weights_sha256": hashlib.sha256(weights).hexdigest(),
    }
    text = json.dumps(full, indent=1, sort_keys=True) + "\n"
    model_id = _identifier(weights, text)
    _write_files(folder / model_id, {_WEIGHTS: weights, _CARD: text.encode()})
    if activate_first and not (folder / ACTIVE).exists():
        activate(model_id, folder, FIRST, expected=None)
    return Model(model_id, surrogate, design_space, tuple(certificates), full)


def load_model(model_id: str | None = None, folder: Path = SHIPPED, *, certified: bool = True) -> Model:
    """Load a model; None is the active one.

    Parameters
    ----------
    certified
        False also takes a model whose card is of an age without certificates, to give it one.

    Raises
    ------
    InvalidInput
        When there is no such model.
    DamagedFile
        When its files are cut short, altered or of another format.
    """
    chosen = active_id(folder) if model_id is None else model_id
    place = folder / chosen
    if not is_model(chosen, folder):
        raise InvalidInput(
            "model", chosen, f"name one of {', '.join(_ids(folder)) or 'none: train one first'}"
        )
    card, weights = _whole_files(place, certified)
    try:
        architecture = Architecture(**card["architecture"])
        network = BoundaryNetwork(architecture)
        network.load_state_dict(safetensors.torch.load(weights))
        space = DesignSpace.from_dict(card["design_space"])
        certificates = tuple(Certificate.from_dict(data) for data in card.get("certificates", ()))
    except (SafetensorError, RuntimeError, TypeError, KeyError) as error:
        raise DamagedFile("model", str(place), f"its files do not fit together ({error}); {_MEND}") from None
    return Model(chosen, Surrogate(network, architecture), space, certificates, card)


def is_model(model_id: str, folder: Path = SHIPPED) -> bool:
    """Whether a folder has a model of this name, damaged or not."""
    return model_id.isalnum() and len(model_id) <= _LONGEST_ID and (folder / model_id).is_dir()


def _whole_files(place: Path, certified: bool) -> tuple[dict[str, Any], bytes]:
    """Card and weights as they were written.

    Raises
    ------
    DamagedFile
        When they are not.
    """
    chosen = place.name
    card, text = _read_card(place, certified)
    try:
        weights = (place / _WEIGHTS).read_bytes()
    except OSError as error:
        raise DamagedFile(
            "model", str(place / _WEIGHTS), f"cannot be read ({error.strerror}); {_MEND}"
        ) from None
    if hashlib.sha256(weights).hexdigest() != card["weights_sha256"]:
        raise DamagedFile(
            "model", str(place / _WEIGHTS), f"its checksum does not hold ({len(weights)} bytes); {_MEND}"
        )
    if _identifier(weights, text) != chosen:
        raise DamagedFile("model", str(place / _CARD), f"the card is not the one written; {_MEND}")
    if card["features"] != list(feature_names()):
        raise DamagedFile(
            "model", str(place), f"it was trained on other features than this code has; {_MEND}"
        )
    return card, weights


_MEND = "restore it from the distribution, train again with `rubscreen train`, or activate another model"


def list_models(folder: Path = SHIPPED) -> list[ModelEntry]:
    """Every model of a folder, the active one first; no network is built, and whole files are read once."""
    try:
        active = active_id(folder)
    except InvalidInput:
        active = ""
    entries = [model_entry(name, folder, active) for name in _ids(folder)]
    return sorted(entries, key=lambda e: (not e.active, e.id))


def model_entry(model_id: str, folder: Path, active: str | None) -> ModelEntry:
    """The line of the model list about one model.

    Its checksums are taken when it is first seen and again when a file of it has been written since.
    """
    place = folder / model_id
    try:
        card = json.loads(_card_of_whole_files(place, _stamp(place / _CARD), _stamp(place / _WEIGHTS)))
    except DamagedFile as error:
        return ModelEntry(model_id, model_id == active, {}, f"{error.value}: {error.remedy}")
    return ModelEntry(model_id, model_id == active, card)


@lru_cache(maxsize=256)
def _card_of_whole_files(place: Path, *stamps: tuple[int, int, int] | None) -> str:
    # As text: a caller may change what it is given.
    return json.dumps(_whole_files(place, certified=True)[0])


def _stamp(file: Path) -> tuple[int, int, int] | None:
    """Changes whenever the file is written."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_ino, found.st_mtime_ns, found.st_size


def _write_files(target: Path, files: dict[str, bytes]) -> None:
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        remedy = f"it cannot be made ({error.strerror}): give another place"
        raise InvalidInput("models folder", str(target.parent), remedy) from None
    if not target.exists():
        with staged(target, "models folder") as beside:
            beside.mkdir()
            for name, content in files.items():
                (beside / name).write_bytes(content)
    for name, content in files.items():
        place = target / name
        if not place.is_file() or place.read_bytes() != content:
            with staged(place, "models folder") as mended:
                mended.write_bytes(content)


def _identifier(weights: bytes, card: str) -> str:
    return hashlib.sha256(weights + card.encode()).hexdigest()[:16]


def _ids(folder: Path) -> list[str]:
    if not folder.is_dir():
        return []
    return sorted(p.name for p in folder.iterdir() if p.is_dir() and not p.name.startswith((".", "_")))


def _read_card(place: Path, certified: bool) -> tuple[dict[str, Any], str]:
    try:
        text = (place / _CARD).read_text(encoding="utf-8")
        card = json.loads(text)
    except (OSError, ValueError) as error:
        raise DamagedFile("model", str(place / _CARD), f"cannot be read ({error}); {_MEND}") from None
    known = card.get("format") if isinstance(card, dict) else None
    if known == _UNCERTIFIED_FORMAT and certified:
        remedy = f"it has no certificates: run `rubscreen models recalibrate {place.name}`"
        raise DamagedFile("model", str(place / _CARD), remedy)
    if known not in (FORMAT, _UNCERTIFIED_FORMAT):
        raise DamagedFile("model", str(place / _CARD), f"it is not a {FORMAT} card; {_MEND}")
    needed = ["weights_sha256", "features", "architecture", "design_space"]
    for key in (*needed, "certificates") if known == FORMAT else needed:
        if key not in card:
            raise DamagedFile("model", str(place / _CARD), f"{key} is missing; {_MEND}")
    return card, text
