"""Path-traced pictures: time and error over the number of samples, other lights, and flicker."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import replace
from statistics import fmean, median

import numpy as np
from numpy.typing import NDArray

from model.generator.path_light_cleaning import cleaning_of
from model.rendering.path_tracing.denoising import Cleaning, denoiser
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.refinement import drawn, refined
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection, Lighting
from model.scene.view import View
from model.scene.volume import Volume
from tests.benchmarks.rows import options, print_machine, print_rows, timed, volumes

Image = NDArray[np.float32]

VIEWS = (View(30, 20, 0, 0.7), View(210, -10, 0, 0.7))
"""From two sides, close enough that the volume fills the picture."""

LIGHTS: tuple[Lighting, ...] = ("none", "direct", "soft")

SETTLING = 4
"""Frames of a turn before those that count."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure each volume under its first TF."""
    parser = options(__doc__, size=128)
    parser.add_argument("--samples", type=int, default=16, help="most of a picture")
    parser.add_argument("--truth", type=int, default=256, help="samples to compare with")
    parser.add_argument("--frames", type=int, default=3, help="of a turn, a degree each")
    asked = parser.parse_args(arguments)
    print_machine()
    for volume in volumes(asked):
        tf = default_transfer_function(volume)
        scenes = [SceneInputs.of(view, tf, light=LightDirection()) for view in VIEWS]
        with closing(PathTracer(volume, seed=1)) as tracer:
            # Other random numbers than those of what is compared with it.
            exact = [
                deque(tracer.refine(scene, asked.size, asked.truth), maxlen=1)[0]
                for scene in scenes
            ]
        title = f"{volume.name}, {asked.size} x {asked.size}"
        heading = ("samples", "s", "RMSE as traced", "denoised", "as shown", "told")
        print_rows(title, heading, over_samples(volume, scenes, exact, asked.size, asked.samples))
        heading = ("light", "ms", "RMSE", "brightened")
        print_rows("Other lights in its place", heading, others(volume, scenes, exact, asked.size))
        if asked.frames:
            heading = ("picture of one sample", "ms", "RMSE", "flicker")
            rows = turned(volume, scenes[0], asked.size, asked.frames, asked.truth)
            print_rows("Turning by a degree a frame", heading, rows)


def over_samples(
    volume: Volume, scenes: list[SceneInputs], exact: list[Estimate], size: int, samples: int
) -> list[tuple[object, ...]]:
    """Draw each scene with ever more samples; return the means over scenes."""
    found: dict[int, list[tuple[float, ...]]] = {}
    cleaning, release = cleaning_of(volume)
    with closing(PathTracer(volume)) as tracer:
        # The first picture takes compilation and preparation.
        drawn(tracer, scenes[0], size, 2, cleaning=cleaning)
        for scene, truth in zip(scenes, exact, strict=True):
            begun = time.perf_counter()
            pictures = [
                (picture, time.perf_counter() - begun)
                for picture in refined(tracer, scene, size, samples, cleaning=cleaning)
            ]
            traced = tracer.refine(scene, size, samples)
            alone = refined(tracer, scene, size, samples, cleaning=cleaning and denoiser)
            for (picture, seconds), *others in zip(pictures, traced, alone, strict=True):
                errors = (_rmse(image.rgba, truth) for image in (*others, picture))
                found.setdefault(picture.samples, []).append((seconds, *errors, picture.error))
    release()
    return [(number, *map(fmean, zip(*rows, strict=True))) for number, rows in found.items()]


def others(
    volume: Volume, scenes: list[SceneInputs], exact: list[Estimate], size: int
) -> list[tuple[object, ...]]:
    """Draw the scenes in the ray caster's lights, as they are and as bright as is nearest."""
    rows = []
    for lighting in LIGHTS:
        found = []
        with closing(RaycastRenderer(volume, lighting)) as renderer:
            renderer.render(scenes[0], size)
            for scene, truth in zip(scenes, exact, strict=True):
                image, seconds = timed(lambda r=renderer, s=scene: r.render(s, size))
                own, true = image[..., :3].ravel(), truth.rgba[..., :3].ravel()
                factor = float(own @ true) / max(float(own @ own), 1e-12)
                bright = np.float32(factor) * image
                found.append((1e3 * seconds, _rmse(image, truth), _rmse(bright, truth)))
        rows.append((lighting, *map(fmean, zip(*found, strict=True))))
    return rows


def turned(
    volume: Volume, first: SceneInputs, size: int, frames: int, truth: int
) -> list[tuple[object, ...]]:
    """Turn a scene: how wrong pictures of one sample are, and how much they flicker.

    Flicker is the 99th percentile of second differences beyond the truth's, in 8-bit steps.
    """
    turn = [
        replace(first, view=replace(first.view, azimuth=first.view.azimuth + number))
        for number in range(SETTLING + frames)
    ]
    cleaning, release = cleaning_of(volume)
    tracers = [PathTracer(volume, seed=seed) for seed in (0, 1)]
    ways: dict[str, Cleaning | None] = {"as traced": None}
    if cleaning is not None:
        ways |= {"denoised": denoiser, "finished": cleaning}

    def draw(tracer: PathTracer, samples: int, way: Cleaning | None) -> Callable[..., Image]:
        return lambda scene: drawn(tracer, scene, size, samples, cleaning=way).rgba[..., :3]

    exact = draw(tracers[1], truth, cleaning)
    right = np.stack([exact(scene) for scene in turn[SETTLING:]])
    rows = []
    for name, way in ways.items():
        picture = draw(tracers[0], 1, way)
        pictures = [timed(lambda s=scene, p=picture: p(s)) for scene in turn][SETTLING:]
        images = np.stack([image for image, _ in pictures])
        beyond = 255 * np.abs(np.diff(images, 2, axis=0) - np.diff(right, 2, axis=0))
        error = float(np.sqrt(np.mean((images - right) ** 2)))
        ms = 1e3 * median(seconds for _, seconds in pictures)
        rows.append((name, ms, error, float(np.percentile(beyond, 99))))
    for end in (release, *(tracer.close for tracer in tracers)):
        end()
    return rows


def _rmse(rgba: Image, exact: Estimate) -> float:
    """Error of the colours, less what the noise of what they are compared with adds."""
    square = np.mean((rgba - exact.rgba)[..., :3].astype(np.float64) ** 2)
    return math.sqrt(max(float(square) - exact.error**2, 0.0))


if __name__ == "__main__":
    main()
