"""A sheet of volumes under their first TFs, path-traced: what a stranger's volume looks like."""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from imageio.v3 import imread, imwrite

from app.cli import run
from model.scene.orientation import home_view
from model.scene.ranges import robust_range
from model.scene.thinned_volume import ThinnedVolume
from model.scene.view import DEFAULT_UP, View, axis_labelled
from model.volume_files import read_volume
from model.volume_files.shipped import first_transfer_function, shipped_volumes

COLUMNS = 3
BACKGROUND = "#0b0d12"


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw each volume from its home view, and write all pictures as one."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--volume", type=Path, action="append", help="may be repeated")
    parser.add_argument("--out", type=Path, required=True, help="JPEG or PNG")
    parser.add_argument("--size", type=int, default=320, help="pixels of a volume's side")
    parser.add_argument("--samples", type=int, default=64)
    asked = parser.parse_args(arguments)
    paths = asked.volume or list(shipped_volumes())
    columns = min(COLUMNS, len(paths))
    rows = math.ceil(len(paths) / columns)
    sheet = np.zeros((rows * asked.size, columns * asked.size, 3), np.uint8)
    with tempfile.TemporaryDirectory() as folder:
        for number, path in enumerate(paths):
            picture = Path(folder) / "picture.png"
            draw(path, picture, asked.size, asked.samples)
            y, x = (asked.size * place for place in divmod(number, columns))
            sheet[y : y + asked.size, x : x + asked.size] = imread(picture)[..., :3]
    quality = {"quality": 88} if asked.out.suffix.lower() in (".jpg", ".jpeg") else {}
    imwrite(asked.out, sheet, **quality)


def draw(path: Path, out: Path, size: int, samples: int) -> None:
    """Draw a volume as the window shows it first."""
    view = home_of(path)
    place = (view.azimuth, view.elevation, view.roll, view.distance, view.pan_x, view.pan_y)
    options = {
        "volume": path,
        "view": ",".join(f"{number:.6g}" for number in place),
        "size": size,
        "samples": samples,
        "background": BACKGROUND,
        "out": out,
    }
    run(["render", "--lighting", "path", *(f"--{key}={v}" for key, v in options.items())])


def home_of(path: Path) -> View:
    """Return the window's home view of a volume, in a square picture."""
    volume = read_volume(path)
    volume = volume.over(robust_range(volume))
    return home_view(
        volume.proportions,
        volume.up or DEFAULT_UP,
        front=axis_labelled("A", volume.axis_labels),
        points=ThinnedVolume.of(volume).shown_points(first_transfer_function(volume).opacity),
    )


if __name__ == "__main__":
    main()
