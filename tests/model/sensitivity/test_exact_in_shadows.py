"""The derivative in shadows against central differences of images in float64.

Where samples lie, what they look at and how surfaces there reflect does not depend on the TF, and
is taken from the ray caster; all that does is written anew. Nothing is skipped or ended early;
light is shared among samples as in the images.
"""

from __future__ import annotations

from typing import Any, get_args

import numpy as np
import pytest
from numpy.typing import NDArray

from model.compilation import compiled
from model.rendering.raycast.batch import fetch, stack_batch
from model.rendering.raycast.camera import camera_array
from model.rendering.raycast.rays import make_ray
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.raycast.shading import reflect
from model.rendering.raycast.shadows import shadow_ray
from model.rendering.raycast.tables import LEVELS_PER_BIN
from model.scene.inputs import SceneInputs
from model.scene.random_tfs import OpacityKind, opacity_tf_of
from model.scene.region import Region
from model.scene.scene import Scene
from model.scene.tf_perturbation import edit_around, with_opacity
from model.scene.transfer_function import ColorTF
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity import exact

SIZE = 18
RANGE = (0.0, 255.0)
VIEW = View(35.0, 25.0, 7.0, 0.6)
COLOR = ColorTF(RANGE, ((0.0, 0.9, 0.4, 0.3), (128.0, 0.4, 0.9, 0.5), (255.0, 0.7, 0.7, 1.0)))
STEP = 0.5
KINDS = [kind for kind in get_args(OpacityKind) if kind != "empty"]

Array = NDArray[np.float64]


def blobs() -> Volume:
    """Balls that cast shadows on one another."""
    rng = np.random.default_rng(5)
    shape = (16, 13, 18)
    places = np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1)
    field = np.zeros(shape)
    for center, radius, value in zip(
        rng.uniform(0, shape, (7, 3)), rng.uniform(3, 6, 7), rng.uniform(80, 255, 7), strict=True
    ):
        distance = np.linalg.norm(places - center, axis=-1)
        field = np.maximum(field, value * np.clip(1.5 - distance / radius, 0, 1))
    field[0, 0, 0], field[-1, -1, -1] = 0, 255
    return Volume(np.rint(np.clip(field, 0, 255)).astype(np.uint8), (1.0, 1.3, 0.8))


@compiled
def look_at(
    voxels: Any,
    shape: Any,
    scale: Any,
    light: Any,
    shadows: Any,
    camera: Any,
    step: float,
    out: Any,
) -> None:
    """Levels along view rays and shadow rays (-1 beyond), lengths of steps, and reflections."""
    seen, parts, dim, surface = out
    levels, staging, _ = stack_batch(voxels)
    size, longest = dim.shape[1], dim.shape[2]
    for row in range(size):
        for column in range(size):
            ray, _ = make_ray(camera, step, column, row, size)
            for k in range(min(ray.count, longest)):
                if k % len(levels) == 0:
                    fetch(voxels, shape, scale, None, ray, k, levels, staging)
                    for m in range(min(len(levels), ray.count - k)):
                        seen[row, column, k + m] = levels[m]
            for k in range(ray.count):
                parts[row, column, k] = ray.rest if k == ray.count - 1 else 1
                t = min(np.float32(k), ray.last)
                found = reflect(voxels, shape, light, ray, t)
                for i in range(3):
                    surface[row, column, k, i] = found[i]
                towards = shadow_ray(shape, shadows, ray, np.float32(k))
                j = 0
                while j < towards.count:
                    fetch(voxels, shape, scale, None, towards, j, levels, staging, True)
                    for m in range(min(len(levels), towards.count - j)):
                        dim[row, column, k, j + m] = levels[m]
                    j += len(levels)


def shared(light: Array, opacity: Array) -> Array:
    """The light of samples, of which faint ones have that of others if it differs little."""
    count = light.shape[-1]
    last = np.minimum(np.arange(count + 4), count - 1)
    light = light[..., last]
    result = light[..., :count].copy()
    for k in range(count):
        low = k - k % 4
        if k == low:
            continue
        inner, own = light[..., k], opacity[..., k]
        halves = [(low, low + 4)]
        if k != low + 2:
            halves.append((low, low + 2) if k < low + 2 else (low + 2, low + 4))
        for first, end in reversed(halves):
            change = light[..., end] - light[..., first]
            between = light[..., first] + change * (k - first) / (end - first)
            counts = np.clip(np.maximum(abs(change) / 0.03, own / 0.04) - 1, 0, 1)
            inner = between + counts * (inner - between)
        result[..., k] = np.where(own >= 0.08, light[..., k], inner)
    return result


class Reference:
    """Images in float64, as a function of the TF's 256 opacities."""

    def __init__(self, renderer: RaycastRenderer, volume: Volume, inputs: SceneInputs) -> None:
        self.shadows = renderer._light.of(inputs, renderer._classified(inputs, STEP)).shadows
        light = renderer._light.of(inputs, renderer._classified(inputs)).gradient
        step = STEP * volume.voxel_size
        longest = int(2 * volume.radius / step) + 2
        seen = np.full((SIZE, SIZE, longest), -1, np.int32)
        parts = np.zeros(seen.shape)
        dim = np.full((*seen.shape, longest), -1, np.int16)
        surface = np.zeros((*seen.shape, 3))
        look_at(
            renderer._voxels, volume.dimensions, renderer._scale, light, self.shadows,
            camera_array(VIEW, volume), step, (seen, parts, dim, surface),
        )  # fmt: skip
        self.seen, self.parts, self.dim = seen, parts, dim
        self.is_last = (seen >= 0) & (
            np.append(seen[..., 1:], np.full((SIZE, SIZE, 1), -1), -1) < 0
        )
        self.diffuse, self.gloss, self.slope = np.moveaxis(surface, -1, 0)
        bins = np.arange(255 * LEVELS_PER_BIN + 1) / LEVELS_PER_BIN
        self.color = np.stack(
            [np.interp(bins, np.arange(256), c) for c in COLOR.sample(RANGE).T.astype(float)], -1
        )

    def image(self, opacity: Array) -> Array:
        per_sample = 1 - (1 - opacity) ** STEP
        levels = np.arange(255 * LEVELS_PER_BIN + 1) / LEVELS_PER_BIN
        # The last entry is what lies beyond a ray.
        table = np.append(np.interp(levels, np.arange(256), per_sample), 0.0)
        whole = table[self.seen]
        alpha = 1 - (1 - whole) ** self.parts
        arriving = shared(np.prod(1 - table[self.dim], axis=-1), np.where(self.is_last, 1, whole))
        scattered = np.exp(-self.slope * float(self.shadows.sharpness) * whole)
        lit = scattered * float(self.shadows.diffuse) * arriving
        shade = (1 - scattered) * self.diffuse + lit
        gloss = (1 - scattered) * self.gloss
        color = self.color[self.seen] * shade[..., None] + gloss[..., None]
        # Whole steps are no brighter than white.
        color = np.where(self.parts[..., None] == 1, np.minimum(color, 1), color)
        behind = np.cumprod(1 - alpha, axis=-1)
        through = np.concatenate([np.ones_like(behind[..., :1]), behind[..., :-1]], axis=-1)
        return np.asarray(((through * alpha)[..., None] * color).sum(axis=2))


@pytest.fixture(scope="module")
def volume() -> Volume:
    return blobs()


@pytest.fixture(scope="module")
def renderer(volume: Volume) -> RaycastRenderer:
    return RaycastRenderer(volume, "shadows", sample_distance=STEP, threads=2)


@pytest.fixture(scope="module")
def reference(renderer: RaycastRenderer, volume: Volume) -> Reference:
    return Reference(renderer, volume, SceneInputs(VIEW, tf_of("modes", volume, 0), COLOR))


def tf_of(kind: OpacityKind, volume: Volume, seed: int):
    return opacity_tf_of(kind, np.random.default_rng([3, seed]), Scene.of(volume, SIZE, "direct"))


def difference(found: NDArray[Any], expected: Array) -> tuple[float, float]:
    """Relative error, and 1 - cosine."""
    found = np.asarray(found, dtype=float)
    error = np.linalg.norm(found - expected) / np.linalg.norm(expected)
    along = (found * expected).sum() / np.linalg.norm(found) / np.linalg.norm(expected)
    return float(error), 1 - float(along)


@pytest.mark.parametrize("kind", KINDS)
def test_derivatives_are_those_of_exact_images(
    kind: OpacityKind, renderer: RaycastRenderer, reference: Reference, volume: Volume
) -> None:
    for seed in range(2):
        inputs = SceneInputs(VIEW, tf_of(kind, volume, seed), COLOR)
        opacity = np.minimum(inputs.opacity_tf.sample(RANGE), 0.98).astype(float)
        inputs = with_opacity(inputs, opacity)
        opacity = inputs.opacity_tf.sample(RANGE).astype(float)
        image = reference.image(opacity)
        assert np.abs(renderer.render(inputs, SIZE)[..., :3] - image).max() < 4e-3
        edits = np.array(
            [edit_around(value, RANGE, 6.0) for value in (15.0, 60.0, 110.0, 160.0, 220.0)]
        )
        changes = np.array(
            [
                (reference.image(opacity + 1e-5 * edit) - reference.image(opacity - 1e-5 * edit))
                / 2e-5
                for edit in edits.astype(float)
            ]
        )
        fields = np.array([renderer.change(inputs, SIZE, edit) for edit in edits])
        region = Region(3, 4, 15, 16)
        part = slice(4, 16), slice(3, 15)
        curve = edits @ exact.region_sensitivity(renderer, inputs, SIZE, region)
        seen, moved = image[part], changes[:, *part]
        expected = (seen * moved).sum(axis=(1, 2, 3)) / np.linalg.norm(seen)
        norms = np.sqrt(
            [
                renderer.squared_changes(inputs, SIZE, np.array([[4, 16, 3, 15]]), edit[None])[0]
                for edit in edits
            ]
        )
        for found, right in (
            (fields, changes),
            (curve, expected),
            (norms, np.sqrt((moved**2).sum(axis=(1, 2, 3)))),
        ):
            error, turned = difference(found, right)
            assert error <= 1e-2 and turned <= 1e-3
