"""Seconds from a chosen file to its pictures, and from *Browse TFs* to its sixteen pictures.

Each volume is opened in a window that shows another one. Then the sixteen are compared: how many
differ from all others, and by how much pairs differ, also as a multiple of the map's cells.
"""

import json
import sys
import time
from itertools import combinations
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from app.state.latent_pictures import CELL_SIZE
from app.state.volume_opening import Wanted
from model.metrics import flip, rmse
from model.volume_files.shipped import shipped_volumes
from tests.benchmarks.motion import PATIENCE_S, close_window, opened_window, run, windows_here
from tests.benchmarks.rows import options, parsed, paths, print_rows, probed

DIFFERENT = 0.05  # RMSE
REST_S = 4.0  # for which all of an opened volume is left alone
SECONDS = "read", "picture", "sharp", "chosen", "coarse", "grid"
DIFFERENCES = "distinct", "RMSE", "RMSE's ratio", "FLIP", "FLIP's ratio"


def made(folder, side, kind):
    """A raw volume of noisy balls: of short integers, or floats over three decades with a gap."""
    path = Path(folder) / f"balls_{side}x{side}x{side}_{kind}.raw"
    place, noise = np.linspace(-1, 1, side, dtype=np.float32), np.random.default_rng(0)
    with path.open("wb") as file:
        for z in place:
            around = place[:, None] ** 2 + z**2
            balls = (around + (place - r / 3) ** 2 < r**2 for r in (0.3, 0.6, 0.9))
            values = 300 * sum(balls) + 15 * noise.standard_normal((side, side), np.float32)
            if kind == "float32":
                values = np.where((place > 0.5) & (z > 0.5), np.nan, 10 ** (values / 300))
            file.write(values.astype(kind).tobytes())
    return path


def distinct(pictures):
    """Number of pictures that all differ from each other, as found from the best first one."""
    apart, best = np.array([[rmse(a, b) for a in pictures] for b in pictures]), 0
    for chosen in ([first] for first in range(len(apart))):
        while (nearest := apart[chosen].min(axis=0)).max() > DIFFERENT:
            chosen.append(int(nearest.argmax()))
        best = max(best, len(chosen))
    return best


def probe(path, scale):
    """Open a volume and browse."""
    found, begun, pictures = {}, 0.0, {}

    def note(name):
        found.setdefault(name, time.perf_counter() - begun)

    def note_picture(result):
        if "read" in found and result.value is not None:
            note("picture")
            if result.value.shape[1] == work.reference.raster.width:
                note("sharp")

    def note_grid(grid):
        if grid and grid.images:
            is_coarse = min(map(len, grid.images.values())) < CELL_SIZE
            note("coarse" if is_coarse else "cells" if grid.cells else "grid")

    def take(name):
        run(PATIENCE_S, lambda: name in found)
        shown = (np.array(each.bits()) for each in window.browser.grid.images.values())
        pictures[name] = [each.reshape(-1, CELL_SIZE, 4)[..., 2::-1] / 255 for each in shown]

    with windows_here():
        window = opened_window([p for p in shipped_volumes() if p.name != path.name][-1])
        work, latent = window.workspace, window.workspace.latent
        run(PATIENCE_S, lambda: work.opened is not None and work.is_settled)
        work.opening.volumeRead.connect(lambda _opened: note("read"))
        window.reference.resultShown.connect(note_picture)
        latent.session.differentChanged.connect(lambda: note("chosen"))
        latent.gridDrawn.connect(note_grid)
        begun = time.perf_counter()
        work.opening.open(path, Wanted(scale=scale))
        run(PATIENCE_S, lambda: "sharp" in found and work.is_settled)
        run(PATIENCE_S, lambda: work.sensitivity.visibility is not None)
        run(REST_S)
        begun = time.perf_counter()
        window.top_bar.browse.click()
        take("grid")
        latent.state.choose(on_map=True)
        take("cells")
        close_window(window)
    found["distinct"] = distinct(pictures["grid"])
    for name, differ in (("RMSE", rmse), ("FLIP", flip)):
        # An empty cell counts as if it were like all others.
        sums = [sum(differ(*pair) for pair in combinations(p, 2)) for p in pictures.values()]
        found[name], found[f"{name}'s ratio"] = sums[0] / 120, sums[0] / sums[1]
    return found


def main(arguments=None):
    words = sys.argv[1:] if arguments is None else arguments
    if words[:1] == ["--probe"]:
        print(json.dumps(probe(Path(words[1]), words[2])))
        return
    asked = parsed(options(__doc__, side=0), words)
    with TemporaryDirectory() as folder:
        given = [(path, "linear") for path in paths(asked)]
        for kind, scale in (("int16", "linear"), ("float32", "log")) if asked.side else ():
            given.append((made(folder, asked.side, kind), scale))
        found = {path.name: probed("opening", path.absolute(), scale) for path, scale in given}
    for title, columns in (("Seconds", SECONDS), ("The sixteen pictures", DIFFERENCES)):
        rows = ((name, *map(each.get, columns)) for name, each in found.items())
        print_rows(title, ("", *columns), rows)


if __name__ == "__main__":
    main()
