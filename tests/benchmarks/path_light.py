"""Path-traced pictures: time and error over the number of samples, other lights, and flicker."""

import math
import time
from collections import deque
from contextlib import ExitStack, closing
from dataclasses import replace
from statistics import fmean

import numpy as np

from model.generator.path_light_cleaning import cleaning_of
from model.rendering.path_tracing.denoising import denoiser
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.view import View
from tests.benchmarks.rows import in_turn, options, parsed, print_rows, volumes

VIEWS = (View(30, 20, 0, 0.7), View(210, -10, 0, 0.7))
"""From two sides, close enough that the volume fills the picture."""

LIGHTS = ("none", "direct", "soft")

SETTLING = 4  # frames of a turn before those that count


def main(arguments=None):
    """Measure each volume under its first TF, against other random numbers."""
    defaults = {"samples": 16, "truth": 256, "frames": 3}
    asked = parsed(options(__doc__, size=128, **defaults), arguments)
    for volume in volumes(asked):
        tf = default_transfer_function(volume)
        scenes = [SceneInputs.of(view, tf, light=LightDirection()) for view in VIEWS]
        with closing(PathTracer(volume, seed=1)) as tracer:
            traced = (tracer.refine(scene, asked.size, asked.truth) for scene in scenes)
            exact = [deque(estimates, maxlen=1)[0] for estimates in traced]
        cleaning, release = cleaning_of(volume)
        title = f"{volume.name}, {asked.size} x {asked.size}"
        rows = over_samples(volume, scenes, exact, asked, cleaning)
        print_rows(title, ("samples", "s", "RMSE, denoised", "as shown"), rows)
        rows = other_lights(volume, scenes, exact, asked)
        print_rows("Other lights, as bright as is nearest", ("light", "ms", "RMSE"), rows)
        if asked.frames:
            rows = turned(volume, scenes[0], asked, cleaning)
            print_rows("Turning by a degree a frame", ("one sample", "flicker"), rows)
        release()


def over_samples(volume, scenes, exact, asked, cleaning):
    """Draw each scene with ever more samples; the means over scenes."""
    found = {}
    with closing(PathTracer(volume)) as tracer:
        # The first picture takes compilation and preparation.
        shown, alone = (RefiningRenderer(tracer, way) for way in (cleaning, cleaning and denoiser))
        shown.drawn(scenes[0], asked.size, 2)
        for scene, truth in zip(scenes, exact, strict=True):
            begun, given = time.perf_counter(), (scene, asked.size, asked.samples)
            pictures = [(picture, time.perf_counter() - begun) for picture in shown.refined(*given)]
            for (picture, seconds), denoised in zip(pictures, alone.refined(*given), strict=True):
                errors = (_rmse(image.rgba, truth) for image in (denoised, picture))
                found.setdefault(picture.samples, []).append((seconds, *errors))
    return [(number, *map(fmean, zip(*rows, strict=True))) for number, rows in found.items()]


def other_lights(volume, scenes, exact, asked):
    """Draw the scenes in the ray caster's lights, each as bright as is nearest."""
    found = {lighting: [] for lighting in LIGHTS}
    with ExitStack() as opened:
        ways = {}
        for lighting in LIGHTS:
            renderer = opened.enter_context(closing(RaycastRenderer(volume, lighting)))
            ways[lighting] = lambda scene, r=renderer: r.render(scene, asked.size)
        for truth, images in zip(exact, in_turn(ways, scenes), strict=True):
            for lighting, (image, seconds) in images.items():
                own, true = image[..., :3].ravel(), truth.rgba[..., :3].ravel()
                bright = np.float32((own @ true) / max(float(own @ own), 1e-12)) * image
                found[lighting].append((1e3 * seconds, _rmse(bright, truth)))
    return [(lighting, *map(fmean, zip(*rows, strict=True))) for lighting, rows in found.items()]


def turned(volume, first, asked, cleaning):
    """Turn a scene: how much pictures of one sample flicker.

    Flicker is the 99th percentile of second differences beyond the truth's, in 8-bit steps.
    """
    turn = [
        replace(first, view=replace(first.view, azimuth=first.view.azimuth + number))
        for number in range(SETTLING + asked.frames)
    ]

    def pictures(tracer, samples, way, scenes):
        renderer = RefiningRenderer(tracer, way, samples)
        images = [renderer.render(scene, asked.size) for scene in scenes]
        return np.diff(np.stack(images)[-asked.frames :, ..., :3], 2, axis=0)

    ways = {"denoised": cleaning and denoiser, "as shown": cleaning}
    with closing(PathTracer(volume)) as tracer, closing(PathTracer(volume, seed=1)) as other:
        exact = pictures(other, asked.truth, cleaning, turn[SETTLING:])
        beyond = {name: pictures(tracer, 1, way, turn) - exact for name, way in ways.items()}
    return [(name, 255 * float(np.percentile(np.abs(d), 99))) for name, d in beyond.items()]


def _rmse(rgba, exact):
    """Error of the colours, less what the noise of what they are compared with adds."""
    square = np.mean((rgba - exact.rgba)[..., :3].astype(np.float64) ** 2)
    return math.sqrt(max(float(square) - exact.error**2, 0.0))


if __name__ == "__main__":
    main()
