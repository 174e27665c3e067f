import imageio.v3 as iio
import numpy as np
import pytest
import torch
from drawing import MODES, RAINBOW, rms

from model.errors import RenderError
from model.rendering.movie_file import write_movie
from model.rendering.raster import BLUR, Raster, blur_of, fill_white_squares, resized
from model.rendering.raycast.renderer import RaycastRenderer
from model.rendering.vtk_renderer import VtkRenderer
from model.scene.inputs import SceneInputs
from model.scene.view import View
from model.scene.volume import Volume

INPUTS = SceneInputs(View(35.0, 20.0, 5.0, 0.8), MODES, RAINBOW)
SIZE = 32


@pytest.fixture(scope="module", params=[VtkRenderer, RaycastRenderer])
def renderer(request, volume):
    return request.param(volume)


def assert_same(one, other):
    # A pixel may fall on the other side of a face by rounding, or a step of 1/255 apart.
    assert rms(one - other) < 1 / 255
    assert np.mean(np.abs(one - other) > 2 / 255) < 0.01


def test_tiles_make_up_the_whole_picture(renderer):
    raster = Raster(40, 24)
    whole = renderer.render(INPUTS, raster)
    put_together = np.zeros_like(whole)
    for tile in raster.tiles(16, 10):
        part = np.s_[tile.top : tile.bottom, tile.left : tile.right]
        put_together[part] = renderer.render(INPUTS, tile)
    assert_same(put_together, whole)
    for row, column in np.ndindex(2, 2):
        part = renderer.render(INPUTS, raster.every_second(row, column))
        put_together[row::2, column::2] = part
    assert_same(put_together, whole)


@pytest.mark.parametrize("shape", [(16, 17), (19, 18)])
def test_white_squares_are_interpolated_along_edges(shape):
    rows, columns = np.indices(shape, dtype=np.float32)
    # A slope of two directions, and an upright edge: both are known between black squares.
    whole = np.stack([2 * rows + columns, np.where(columns < 7, 0, 9), rows, rows], axis=-1)
    image = np.where(((rows + columns) % 2 == 0)[..., None], whole, 99).astype(np.float32)
    fill_white_squares(image)
    np.testing.assert_array_equal(image[1:-1, 1:-1, 1], whole[1:-1, 1:-1, 1])
    np.testing.assert_array_equal(image[1:-1, 1:-1, 0], whole[1:-1, 1:-1, 0])


def test_a_scaled_picture_keeps_its_proportions():
    whole = Raster(1200, 300)
    assert whole.scaled(0.5) == Raster(600, 150)
    assert whole.scaled(0.5).reach == whole.reach
    assert Raster(100, 80, 10, 10, 20, 20).scaled(2) == Raster(200, 160)
    assert whole.scaled(0.001) == Raster(16, 16)


def test_a_grown_part_ends_with_the_picture():
    part = Raster(100, 60, left=10, top=50, columns=30, rows=5)
    wide = part.grown(12)
    assert (wide.left, wide.right, wide.top, wide.bottom) == (0, 52, 38, 60)
    assert (wide.width, wide.height) == (100, 60)
    assert Raster(100, 60).grown(8) == Raster(100, 60, columns=100, rows=60)


@pytest.mark.parametrize("shape", [(7, 9), (20, 31), (5, 40)])
def test_pixels_between_are_interpolated_as_torch_does(shape):
    image = np.random.default_rng(0).random((5, 9, 4)).astype(np.float32)
    planes = torch.from_numpy(image).permute(2, 0, 1)[None]
    theirs = torch.nn.functional.interpolate(planes, shape, mode="bilinear")
    found = resized(image, shape)
    np.testing.assert_allclose(found, theirs[0].permute(1, 2, 0).numpy(), atol=1e-6)


# imageio leaves its reader's pipes to the garbage collection.
pytestmark = [
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_movies_can_be_read_again(tmp_path, suffix):
    levels = np.linspace(0.1, 0.9, 6)
    frames = (np.full((47, 65, 3), round(255 * level), np.uint8) for level in levels)
    path = write_movie(tmp_path / f"path{suffix}", frames, 25)
    read = np.asarray(iio.imread(path, index=None if suffix == ".gif" else ...))
    middle = read[:, 20, 20, 0].astype(np.float64) / 255
    # The sides of an MP4 are even.
    assert read.shape[:3] == ((6, 47, 65) if suffix == ".gif" else (6, 46, 64))
    assert middle == pytest.approx(levels, abs=0.06)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_the_longest_side_of_a_voxel_decides_about_its_normals():
    thin, cubes = (Volume(np.zeros((2, 2, 2), np.uint8), s) for s in ((1.0, 1.0, 3.0), (3.0,) * 3))
    found = [blur_of(View(), cubes, Raster(side, 2 * side)) for side in (4, 400)]
    assert found == [0.0, BLUR]
    rasters = [Raster(side, side) for side in range(2, 20)]
    assert any(blur_of(View(), thin, r) > 0 == blur_of(View(), thin, r, 1.4) for r in rasters)


def test_movies_of_unknown_formats_are_refused(tmp_path):
    frames = [np.zeros((16, 16, 3), dtype=np.uint8)]
    with pytest.raises(RenderError, match="movies end in"):
        write_movie(tmp_path / "path.txt", frames, 25)
    for suffix in (".mp4", ".gif"):
        with pytest.raises(RenderError, match=r"missing/path.+ written \(No such file or dir"):
            write_movie(tmp_path / "missing" / f"path{suffix}", frames, 25)
