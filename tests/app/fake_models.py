"""Folders that look like trained models."""

import hashlib
import json
from dataclasses import asdict

from ramp import make_volume

from model.networks.card import MODEL_FILE, ModelCard
from model.networks.size import NetworkSize
from model.scene.scene import FORMAT_VERSION, Scene

WEIGHTS = bytes(range(256)) * 8


def make_model(folder, name="ramp", top=200.0, **changes):
    """A model folder whose weights are any bytes: nobody draws with it."""
    scene = Scene.of(make_volume(name, top), 64)
    metrics = {"holdout": {"rmse": 0.05}}
    card = ModelCard(scene, "draft", NetworkSize(image_size=64), metrics=metrics)
    folder.mkdir(parents=True)
    (folder / "generator-1.safetensors").write_bytes(WEIGHTS)
    header = {
        "tfscope_model": FORMAT_VERSION, "weights": "generator-1.safetensors",
        "sha256": hashlib.sha256(WEIGHTS).hexdigest(), **asdict(card), **changes,
    }  # fmt: skip
    (folder / MODEL_FILE).write_text(json.dumps(header))
    return folder
