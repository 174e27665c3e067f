"""The grid of pictures that differ most, against the means of the map's cells: how far apart.

With ``--window`` it is opened in the window, and timed from the click.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from app.state.latent_pictures import CELL_SIZE, GridPicture
from app.state.latent_session import FIRST_BRUSH
from app.state.opened_volume import OpenedVolume
from model.latent.latent_space import LatentSpace
from model.latent.tiny_pictures import DIFFERING, exposures, overview_of
from model.metrics import flip
from model.rendering.brightness import LIT_BRIGHTNESS, brighten
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.orientation import home_view
from model.scene.ranges import robust_range
from model.scene.view import DEFAULT_UP, axis_labelled
from model.volume_files import read_volume
from tests.benchmarks.motion import PATIENCE_S, close_window, opened_window, run, windows_here
from tests.benchmarks.rows import options, paths, print_machine, print_rows, timed

APART = 0.05
"""Root mean square difference of two pictures from which they count as different."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Choose, draw and compare; both grids are exposed alike."""
    parser = options(__doc__, size=96)
    parser.add_argument("--window", action="store_true", help="time it from the click")
    asked = parser.parse_args(arguments)
    print_machine()
    if asked.window:
        with windows_here():
            rows = [(path.name, *_from_the_click(path)) for path in paths(asked)]
        print_rows("From the click, s", ("volume", "16 pictures", "sharp"), rows)
        return
    rows = []
    for path in paths(asked):
        read = read_volume(path)
        opened = OpenedVolume.of(path, read.over(robust_range(read)))
        volume, tf = opened.volume, opened.default
        front = axis_labelled("A", volume.axis_labels)
        view = home_view(
            volume.proportions, volume.up or DEFAULT_UP, front=front, points=opened.shown
        )
        inputs, renderer = SceneInputs.of(view, tf), RaycastRenderer(volume, "direct")
        space = LatentSpace.shipped(volume.scalar_range, opened.window, volume.scale)
        map_ = space.open_map()
        tfs = space.frame.stretched(map_.samples.tfs)

        def choose(volume=volume, inputs=inputs, tfs=tfs):  # the loop's, as they are now
            return overview_of(volume, inputs, tfs).most_different(np.ones(len(tfs), bool))

        def draw(opacities, renderer=renderer, inputs=inputs, space=space):
            found = [
                renderer.render(replace(inputs, opacity_tf=space.frame.opacity_tf(o)), asked.size)
                for o in opacities
            ]
            return np.stack(found)[..., :3]

        # The first time takes the compilation of kernels.
        overview_of(volume, inputs, tfs[:2], 4)
        draw(map_.samples.tfs[:1])
        chosen, choosing = timed(choose)
        images, drawing = timed(lambda d=draw, m=map_, c=chosen: d(m.samples.tfs[c]))
        cells = map_.cells(FIRST_BRUSH)
        means = draw(space.codec.decode(cells.codes[cells.count > 0]))
        renderer.close()
        most, usual = _figures(images), _figures(means)
        rows.append((volume.name, choosing + drawing, *most, *usual))
    heading = "volume", "s", "pairs", "distinct", "FLIP", "cells: pairs", "distinct", "FLIP"
    print_rows("Pairs of 16 pictures that differ, of 120", heading, rows)


def _from_the_click(path: Path) -> tuple[float | None, float | None]:
    """Seconds until there are 16 pictures, and until these are sharp."""
    window = opened_window(path)
    pictures = window.workspace.latent
    run(
        PATIENCE_S,
        lambda: (
            not window.workspace.opening.is_busy
            and window.workspace.opened is not None
            and window.workspace.is_settled
        ),
    )
    seen: list[tuple[float, int]] = []
    begun = time.perf_counter()

    def note(grid: GridPicture | None) -> None:
        if grid is not None and len(grid.images) == DIFFERING:
            seen.append((time.perf_counter() - begun, len(grid.images[0])))

    pictures.gridDrawn.connect(note)
    window.top_bar.browse.click()
    run(PATIENCE_S, lambda: bool(seen) and seen[-1][1] >= CELL_SIZE)
    close_window(window)
    sharp = next((at for at, width in seen if width >= CELL_SIZE), None)
    return seen[0][0] if seen else None, sharp


def _figures(images: np.ndarray) -> tuple[int, int, float]:
    """Pairs that differ, the largest set found of which all do, and the pairs' mean FLIP."""
    shown = images.copy()
    factors = exposures(images.reshape(len(images), -1, 3), LIT_BRIGHTNESS)
    for image, factor in zip(shown, factors, strict=True):
        brighten(image, float(factor))
    flat = shown.reshape(len(shown), -1).astype(np.float64)
    apart = np.sqrt(np.square(flat[:, None] - flat).mean(axis=2))
    largest = 0
    for chosen in [[first] for first in range(len(flat))]:
        while apart[chosen].min(axis=0).max() > APART:
            chosen.append(int(apart[chosen].min(axis=0).argmax()))
        largest = max(largest, len(chosen))
    pairs = list(zip(*np.triu_indices(len(flat), 1), strict=True))
    differing = sum(bool(apart[a, b] > APART) for a, b in pairs)
    return differing, largest, sum(flip(shown[a], shown[b]) for a, b in pairs) / 120


if __name__ == "__main__":
    main()
