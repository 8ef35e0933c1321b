"""The models folder of a service that keeps data: made once, by however many replicas start together."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

from service.rest.models_folder import models_folder, prepare_models
from service.settings import Settings
from training.activation import active_id
from training.registry import SHIPPED, list_models


def test_replicas_that_start_together_make_one_models_folder(tmp_path):
    for attempt in range(5):
        settings = Settings(data_folder=tmp_path / str(attempt))
        with ThreadPoolExecutor(8) as pool:
            list(pool.map(prepare_models, [settings] * 8))
        folder = models_folder(settings)
        assert active_id(folder) == active_id(SHIPPED)
        assert [(entry.id, entry.damage) for entry in list_models(folder)] == [(active_id(SHIPPED), None)]
        assert not [path for path in folder.iterdir() if path.is_dir() and path.name.startswith(".")]
