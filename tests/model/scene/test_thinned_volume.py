import numpy as np
import pytest

from model.scene.crop import CropBox
from model.scene.orientation import corners
from model.scene.thinned_volume import GRID, ThinnedVolume
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.scene.volume import Volume


def test_rays_through_a_uniform_medium_follow_beers_law():
    # Spacings whose product is 1 make the voxel size 1.
    volume = Volume(np.linspace(0.0, 1.0, 4 * 6 * 10).reshape(4, 6, 10), (0.5, 1.0, 2.0))
    rays = ThinnedVolume.of(volume).ray_opacities(OpacityTF((0.0, 1.0), points=((0.0, 0.1),)))
    lengths = np.repeat([4 * 2.0, 6 * 1.0, 10 * 0.5], [60, 40, 24])
    assert rays == pytest.approx(1 - 0.9**lengths)


def test_a_finer_volume_is_as_opaque_on_the_grid():
    fine = Volume(np.linspace(0.0, 1.0, 8 * 8 * 256).reshape(8, 8, 256))
    thinned = ThinnedVolume.of(fine)
    assert thinned.levels.shape == (8, 8, GRID)
    along_x = thinned.ray_opacities(OpacityTF((0.0, 1.0), points=((0.0, 0.01),)))[-64:]
    assert along_x == pytest.approx(np.full(64, 1 - 0.99**256))


def test_the_box_lies_around_what_is_shown_and_not_around_specks():
    scalars = np.zeros((40, 40, 40))
    scalars[10:20, 4:36, 20:30] = 1.0
    scalars[38, 38, 38] = 1.0
    box = ThinnedVolume.of(Volume(scalars)).shown_box(OpacityTF((0, 1), points=((0.5, 0), (1, 1))))
    first, end = np.array((20, 4, 10)) / 40, np.array((30, 36, 20)) / 40
    for margin in (first - box.low, np.array(box.high) - end):
        assert (margin >= -1e-9).all()
        assert (margin <= 1 / 40 + 1e-9).all()
    # Where nothing is shown it is the whole volume.
    assert ThinnedVolume.of(Volume(scalars)).shown_box(OpacityTF((0.0, 1.0))) == CropBox()


def test_shown_points_reach_around_what_is_shown_and_no_farther():
    scalars = np.zeros((20, 30, 40), np.float32)
    z, y, x = np.mgrid[:20, :30, :40]
    ball = (x - 20) ** 2 + (y - 15) ** 2 + (z - 10) ** 2 <= 64
    scalars[ball] = 1
    opacity = OpacityTF((0, 1), points=((0.5, 0), (1, 1)))
    thinned = ThinnedVolume.of(Volume(scalars))
    points = thinned.shown_points(opacity) * (40, 30, 20)
    # Voxels lie at the middles of their cells.
    radii = np.linalg.norm(points - (20.5, 15.5, 10.5), axis=1)
    assert radii.max() < 8 + 1.0
    assert np.abs(points[:, 0] - 20.5).max() == pytest.approx(8.5, abs=1)
    assert np.abs(points[:, 2] - 10.5).max() == pytest.approx(8, abs=1)
    nothing = thinned.shown_points(OpacityTF((0.0, 1.0)))
    np.testing.assert_array_equal(nothing, corners(CropBox()))


def test_missing_voxels_show_nothing_unless_they_are_drawn():
    voxels = np.full((8, 8, 8), 200, np.uint8)
    voxels[0, 0, 0] = 0
    missing = np.zeros(voxels.shape, bool)
    missing[:, :, 3:] = True
    volume = Volume(voxels, missing=missing)
    opacity = OpacityTF((0.0, 200.0), (GaussianMode(200.0, 10.0, 0.5),))
    thinned = ThinnedVolume.of(volume)
    assert thinned.shown_box(opacity).high[0] <= 0.5
    rays = thinned.ray_opacities(opacity)
    # Those along x meet three voxels, those along y and z eight or none.
    np.testing.assert_allclose(rays[-1], 1 - 0.5**3, rtol=1e-6)
    np.testing.assert_allclose(rays[7], 0, atol=1e-12)
    whole = ThinnedVolume.of(volume.drawing_missing(True))
    np.testing.assert_allclose(whole.ray_opacities(opacity)[-1], 1 - 0.5**8, rtol=1e-6)


def test_what_is_made_visible_ends_half_of_its_rays_at_four_fifths():
    # A ball of 150 in a box of 0, of which every ray along an axis passes as many voxels.
    z, y, x = np.mgrid[-20:21, -20:21, -20:21]
    inside = x**2 + y**2 + z**2 <= 15**2
    volume = Volume(np.where(inside, 150, 0).astype(np.uint8))
    faint = OpacityTF((0.0, 150.0), modes=(GaussianMode(150.0, 10.0, 0.01),))
    seen = ThinnedVolume.of(volume).made_visible(faint)
    (mode,) = seen.modes
    assert (mode.mean, mode.width) == (150.0, 10.0)
    counts = inside.sum(axis=0)
    ends = 1 - (1 - mode.amplitude) ** counts[counts > 0]
    assert np.median(ends) == pytest.approx(0.8, abs=0.02)
    # What shows already, or cannot, stays as it is.
    assert ThinnedVolume.of(volume).made_visible(seen) == seen
    nothing = OpacityTF((0.0, 150.0), modes=(GaussianMode(80.0, 5.0, 0.01),))
    assert ThinnedVolume.of(volume).made_visible(nothing) == nothing
