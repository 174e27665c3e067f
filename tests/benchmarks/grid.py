"""The grid of pictures that differ most, against the means of the map's cells: how far apart."""

from contextlib import closing
from dataclasses import replace
from itertools import combinations
from statistics import fmean

import numpy as np

from app.state.latent_session import FIRST_BRUSH
from model.latent.latent_space import LatentSpace
from model.latent.tiny_pictures import exposures, overview_of
from model.metrics import flip, rmse
from model.rendering.brightness import LIT_BRIGHTNESS, brighten
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from tests.benchmarks.gallery import at_home
from tests.benchmarks.rows import options, parsed, paths, print_rows, timed

APART = 0.05  # root mean square difference of two pictures from which they count as different


def main(arguments=None):
    """Choose, draw and compare; both grids are exposed alike."""
    asked = parsed(options(__doc__, size=96), arguments)
    rows = [(path.name, *_compared(path, asked.size)) for path in paths(asked)]
    heading = "volume", "s", "pairs", "FLIP", "cells: pairs", "FLIP"
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


def _figures(images):
    """Pairs that differ, and the pairs' mean FLIP."""
    shown = images.copy()
    factors = exposures(images.reshape(len(images), -1, 3), LIT_BRIGHTNESS)
    for image, factor in zip(shown, factors, strict=True):
        brighten(image, float(factor))
    pairs = list(combinations(shown, 2))
    return sum(rmse(*pair) > APART for pair in pairs), fmean(flip(*pair) for pair in pairs)


if __name__ == "__main__":
    main()
