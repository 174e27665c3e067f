"""Lights in place of path-traced light, measured against it."""

from __future__ import annotations

import numpy as np
import pytest

from model.benchmarks.path_tracing import RAYCAST_LIGHTS, exact_pictures, other_light_rows
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Scene
from model.scene.volume import Volume


@pytest.mark.slow
def test_other_lights_are_compared_with_many_paths(volume: Volume, scene: Scene) -> None:
    scenes = [draw_sample(scene, 0, "holdout", number) for number in (1, 2)]
    rows = list(other_light_rows(volume, scenes, 24, exact_pictures(volume, scenes, 24, 64)))
    assert [row.lighting for row in rows] == [each for each in RAYCAST_LIGHTS for _ in scenes]
    assert all(row.brightened <= row.error and row.seconds > 0 for row in rows)

    tracer, caster = PathTracer(volume, samples=512, seed=5), RaycastRenderer(volume, "soft")
    own, true = (
        each.render(scenes[0], 24)[..., :3].astype(np.float64) for each in (caster, tracer)
    )
    (soft,) = (row for row in rows if (row.lighting, row.scene) == ("soft", 0))
    assert soft.error == pytest.approx(np.sqrt(np.mean((own - true) ** 2)), rel=0.2, abs=0.002)
    tracer.close()
    caster.close()
