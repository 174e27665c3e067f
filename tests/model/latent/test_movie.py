from __future__ import annotations

from pathlib import Path

import imageio.v3 as iio
import numpy as np
import pytest

from model.errors import LatentError
from model.latent.movie import movie_frame
from model.latent.picture_file import read_picture
from model.scene.transfer_function import ColorTF, OpacityTF

COLORS = ColorTF((0.0, 1.0), ((0.0, 1.0, 0.0, 0.0), (1.0, 1.0, 0.0, 0.0)))
STEP = OpacityTF((0.0, 1.0), points=((0.5, 0.0), (0.5, 1.0)))


def test_a_frame_has_the_picture_above_the_tf() -> None:
    image = np.full((64, 64, 4), 0.5, dtype=np.float32)
    frame = movie_frame(image, STEP, COLORS)
    assert frame.shape[1] == 64
    assert frame.shape[0] > 64
    assert (frame[:64] == 128).all()
    strip = frame[66:-2]
    assert (strip[:, 40:, 0] == 255).all()
    assert (strip[:, 40:, 1] == 0).all()
    assert (strip[:, :24] < 40).all()


def test_pictures_of_all_kinds_become_premultiplied(tmp_path: Path) -> None:
    rgba = np.zeros((10, 20, 4), dtype=np.uint8)
    rgba[:, 5:15] = 200, 100, 50, 128
    for name, pixels in (
        ("rgba.png", rgba),
        ("rgb.png", rgba[..., :3]),
        ("gray.png", rgba[..., 0]),
    ):
        iio.imwrite(tmp_path / name, pixels)
        picture = read_picture(tmp_path / name)
        assert picture.shape == (10, 10, 4)
        alpha = 128 / 255 if name == "rgba.png" else 1.0
        assert picture[..., 3] == pytest.approx(alpha, abs=1e-3)
        scale = alpha if name == "rgba.png" else 1.0
        assert picture[..., 0] == pytest.approx(200 / 255 * scale, abs=1e-3)


def test_files_that_are_no_pictures_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.png"
    path.write_bytes(b"no picture")
    with pytest.raises(LatentError, match="cannot be read"):
        read_picture(path)
