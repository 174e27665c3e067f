from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray
from ramp import make_volume
from window_fakes import make_request

from app.engines.engines import GeneratorEngine, ReferenceSettings, RendererEngine
from app.state.dispatcher import LIVE_COARSENESS, quality_of
from model.generator.backends import Backend
from model.scene.scene import Scene


class RecordingRenderer:
    def __init__(self) -> None:
        self.calls: list[tuple[int, float]] = []

    def render(self, inputs: object, size: int, sample_distance: float) -> NDArray[Any]:
        self.calls.append((size, sample_distance))
        return np.zeros((size, size, 4), dtype=np.float32)


@pytest.mark.parametrize(("size", "live_size"), [(128, 128), (512, 256)])
def test_live_images_of_vtk_are_coarser_and_final_ones_are_not(size: int, live_size: int) -> None:
    renderer = RecordingRenderer()
    engine = RendererEngine(cast(Any, renderer), sample_distance=0.5)
    for live in (True, False):
        request = make_request(1, live)
        engine.image(replace(request, quality=quality_of(size, live)))
    assert renderer.calls == [(live_size, 0.5 * LIVE_COARSENESS), (size, 0.5)]


def test_the_reference_is_lit_as_the_training_images_were() -> None:
    scene = Scene.of(make_volume(), image_size=16, lighting="direct")
    settings = ReferenceSettings.of(scene)
    assert (settings.lighting, settings.light) == ("direct", scene.light)
    assert settings.sample_distance == scene.sample_distance


@pytest.mark.parametrize(
    ("kind", "backend", "words"),
    [
        ("cpu", Backend("eager"), "CPU"),
        ("cuda", Backend("compiled"), "GPU, compiled"),
        ("cpu", Backend("openvino", "bfloat16"), "CPU, OpenVINO, bfloat16"),
    ],
)
def test_a_generator_says_where_and_by_what_it_runs(
    kind: str, backend: Backend, words: str
) -> None:
    generator = SimpleNamespace(device=SimpleNamespace(type=kind), scene=None, backend=backend)
    assert GeneratorEngine(cast(Any, generator)).description == words
