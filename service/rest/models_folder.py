"""Where the service's models are: of its own where it keeps data, else those that came with the package."""

from __future__ import annotations

import logging
import shutil
import uuid
from pathlib import Path

from sdm_core.errors import InvalidInput
from service.settings import Settings
from training.activation import FIRST, SHIPPED, activate, active_id

logger = logging.getLogger("rubscreen.service")


def models_folder(settings: Settings) -> Path:
    """The folder that the settings mean."""
    if settings.models_folder is not None:
        return settings.models_folder
    return SHIPPED if settings.data_folder is None else settings.data_folder / "models"


def prepare_models(settings: Settings) -> None:
    """Put the shipped model into a folder of one's own, where retraining can add others.

    It becomes active in a new folder. In one that is there it only lies ready: what was promoted stays so.

    Raises
    ------
    OSError
        When it cannot be copied.
    """
    folder = models_folder(settings)
    if settings.models_folder is not None or folder == SHIPPED:
        return
    shipped = active_id(SHIPPED)
    place = folder / shipped
    if not place.is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        # No model by such a name is ever listed; of its own, for another replica may start at the same time.
        beside = folder / f".{shipped}-{uuid.uuid4().hex}"
        shutil.copytree(SHIPPED / shipped, beside)
        try:
            beside.rename(place)
        except OSError:  # another replica was first
            shutil.rmtree(beside, ignore_errors=True)
        if (folder / "active").exists():
            logger.info("model %s came with this version; promote it to use it", shipped)
    if not (folder / "active").exists():
        try:
            activate(shipped, folder, FIRST, expected=None)
        except InvalidInput:
            if not (folder / "active").exists():  # nor has another replica just done it
                raise
