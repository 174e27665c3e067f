"""A sheet of volumes under their first TFs, path-traced: what a stranger's volume looks like."""

import math
import tempfile
from pathlib import Path

import numpy as np
from imageio.v3 import imread, imwrite

from app.cli import run
from app.state.opened_volume import OpenedVolume
from model.scene.orientation import home_view
from model.scene.ranges import robust_range
from model.scene.view import DEFAULT_UP, axis_labelled
from model.volume_files import read_volume
from tests.benchmarks.rows import options, parsed, paths

COLUMNS = 3
BACKGROUND = "#0b0d12"


def main(arguments=None):
    """Draw each volume from its home view, and write all pictures as one."""
    parser = options(__doc__, size=320, samples=64)
    parser.add_argument("--out", type=Path, required=True, help="JPEG or PNG")
    asked = parsed(parser, arguments)
    files = paths(asked)
    columns = min(COLUMNS, len(files))
    rows = math.ceil(len(files) / columns)
    sheet = np.zeros((rows * asked.size, columns * asked.size, 3), np.uint8)
    with tempfile.TemporaryDirectory() as folder:
        for number, path in enumerate(files):
            picture = Path(folder) / "picture.png"
            draw(path, picture, asked.size, asked.samples)
            y, x = (asked.size * place for place in divmod(number, columns))
            sheet[y : y + asked.size, x : x + asked.size] = imread(picture)[..., :3]
    quality = {"quality": 88} if asked.out.suffix.lower() in (".jpg", ".jpeg") else {}
    imwrite(asked.out, sheet, **quality)


def draw(path, out, size, samples):
    """Draw a volume as the window shows it first."""
    volume = read_volume(path)
    shown = OpenedVolume.of(path, volume.over(robust_range(volume))).shown
    front, up = axis_labelled("A", volume.axis_labels), volume.up or DEFAULT_UP
    view = home_view(volume.proportions, up, front=front, points=shown)
    place = (view.azimuth, view.elevation, view.roll, view.distance, view.pan_x, view.pan_y)
    looks = {"view": ",".join(f"{number:.6g}" for number in place), "background": BACKGROUND}
    given = {"volume": path, "size": size, "samples": samples, "out": out, **looks}
    run(["render", "--lighting=path", *(f"--{name}={value}" for name, value in given.items())])


if __name__ == "__main__":
    main()
