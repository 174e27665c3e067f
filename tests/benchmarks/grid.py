"""The grid of pictures that differ most, against the means of the map's cells: how far apart.

With `--window` it is opened in the window, and timed from the click.
"""

import time
from contextlib import closing
from dataclasses import replace

import numpy as np

from app.state.latent_pictures import CELL_SIZE
from app.state.latent_session import FIRST_BRUSH
from model.latent.latent_space import LatentSpace
from model.latent.tiny_pictures import DIFFERING, exposures, overview_of
from model.metrics import flip
from model.rendering.brightness import LIT_BRIGHTNESS, brighten
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from tests.benchmarks.gallery import at_home
from tests.benchmarks.motion import PATIENCE_S, close_window, opened_window, run, windows_here
from tests.benchmarks.rows import options, parsed, paths, print_rows, timed

APART = 0.05
"""Root mean square difference of two pictures from which they count as different."""


def main(arguments=None):
    """Choose, draw and compare; both grids are exposed alike."""
    parser = options(__doc__, size=96)
    parser.add_argument("--window", action="store_true", help="time it from the click")
    asked = parsed(parser, arguments)
    if asked.window:
        with windows_here():
            rows = [(path.name, *_from_the_click(path)) for path in paths(asked)]
        print_rows("From the click, s", ("volume", "16 pictures", "sharp"), rows)
        return
    rows = [(path.name, *_compared(path, asked.size)) for path in paths(asked)]
    heading = "volume", "s", "pairs", "distinct", "FLIP", "cells: pairs", "distinct", "FLIP"
    print_rows("Pairs of 16 pictures that differ, of 120", heading, rows)


def _compared(path, size):
    """Seconds to choose and draw the pictures that differ, and figures of these and of means."""
    opened, view = at_home(path)
    volume, inputs = opened.volume, SceneInputs.of(view, opened.default)
    space = LatentSpace.shipped(volume.scalar_range, opened.window, volume.scale)
    map_ = space.open_map()
    tfs = space.frame.stretched(map_.samples.tfs)

    def choose():
        return overview_of(volume, inputs, tfs).most_different(np.ones(len(tfs), bool))

    with closing(RaycastRenderer(volume, "direct")) as renderer:

        def draw(opacities):
            curves = (space.frame.opacity_tf(each) for each in opacities)
            found = [renderer.render(replace(inputs, opacity_tf=curve), size) for curve in curves]
            return np.stack(found)[..., :3]

        # The first time takes the compilation of kernels.
        overview_of(volume, inputs, tfs[:2], 4)
        draw(map_.samples.tfs[:1])
        chosen, choosing = timed(choose)
        images, drawing = timed(lambda: draw(map_.samples.tfs[chosen]))
        cells = map_.cells(FIRST_BRUSH)
        means = draw(space.codec.decode(cells.codes[cells.count > 0]))
    return choosing + drawing, *_figures(images), *_figures(means)


def _from_the_click(path):
    """Seconds until there are 16 pictures, and until these are sharp."""
    window = opened_window(path)
    work = window.workspace
    run(PATIENCE_S, lambda: not work.opening.is_busy and work.opened and work.is_settled)
    seen, begun = [], time.perf_counter()

    def note(grid):
        if grid is not None and len(grid.images) == DIFFERING:
            seen.append((time.perf_counter() - begun, len(grid.images[0])))

    work.latent.gridDrawn.connect(note)
    window.top_bar.browse.click()
    run(PATIENCE_S, lambda: bool(seen) and seen[-1][1] >= CELL_SIZE)
    close_window(window)
    sharp = next((at for at, width in seen if width >= CELL_SIZE), None)
    return seen[0][0] if seen else None, sharp


def _figures(images):
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
