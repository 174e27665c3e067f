import hashlib

import numpy as np
import pytest

from model.errors import VolumeError
from model.scene.crop import CropBox
from model.scene.filling import fill
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.scene.volume import Volume


def ramp(dtype="float32", shape=(4, 5, 6)):
    return np.arange(np.prod(shape), dtype=dtype).reshape(shape)


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("bins", [1, 7, 256])
@pytest.mark.parametrize("shape", [(7, 9, 8), (103, 101, 102)])
def test_histogram_of_fractions_is_numpys(dtype, bins, shape):
    scalars = np.random.default_rng(3).normal(20, 30, shape).astype(dtype)
    counts, edges = Volume(scalars).histogram(bins)
    expected, expected_edges = np.histogram(scalars.astype(np.float64), bins=bins)
    np.testing.assert_allclose(edges, expected_edges)
    np.testing.assert_array_equal(counts, expected)


def test_integers_have_no_comb():
    """Each value from -20 to 280 occurs as often, in whatever type: so does each bin's share."""
    for step, dtype in [(1, "int16"), (1, "float32"), (1, "int64"), (257, "int32")]:
        values = np.tile(np.arange(-20, 281), 8).reshape(8, 7, 43) * step
        counts, edges = Volume(values.astype(dtype)).histogram()
        assert edges[0] == -20.5 * step and edges[-1] >= 280.5 * step
        np.testing.assert_array_equal(np.diff(edges), 2 * step)
        np.testing.assert_array_equal(counts[:-1], 16)
        assert counts.sum() == values.size


@pytest.mark.parametrize("dtype", ["int16", "int64", "float64"])
@pytest.mark.parametrize("far", [3_000, 10**15])
def test_histogram_goes_on_beyond_the_range(dtype, far):
    scalars = np.random.default_rng(3).normal(20, 3e3, (7, 9, 8)).astype(dtype)
    scalars[0, 0, 0] = min(far, 2**15 - 1) if dtype == "int16" else far
    volume = Volume(scalars).over((0.0, 500.0))
    inner, inner_edges = volume.histogram()
    counts, edges = volume.histogram(beyond=True)
    assert counts.sum() == scalars.size and len(counts) <= 3 * 256
    assert (np.diff(edges) >= 0.999 * (inner_edges[1] - inner_edges[0])).all()
    assert edges[0] <= scalars.min() and edges[-1] >= scalars.max()
    first = int(np.searchsorted(edges, inner_edges[0]))
    np.testing.assert_array_equal(edges[first : first + len(inner_edges)], inner_edges)
    np.testing.assert_array_equal(counts, np.histogram(scalars, bins=edges)[0])
    # The last of them includes its end, which is the next one's beginning.
    np.testing.assert_array_equal(counts[first : first + len(inner) - 1], inner[:-1])


def test_over_a_range_the_voxels_are_what_they_were_and_the_way_back_is_open():
    whole = Volume(ramp())
    volume = whole.over((10.25, 59.5))
    assert volume.scalar_range == (10.25, 59.5)
    assert volume.data_range == whole.scalar_range == (0.0, 119.0)
    assert volume.voxels is whole.voxels
    assert volume.over(whole.data_range).scalar_range == (0.0, 119.0)


def test_fingerprint_tells_voxels_type_and_spacing_apart():
    volume = Volume(ramp())
    same = Volume(ramp().astype(">f4"), name="other name")
    assert volume.fingerprint == same.fingerprint
    different = [
        Volume(ramp("float64")),
        Volume(ramp() + 1),
        Volume(ramp(), (1.0, 1.0, 2.0)),
        Volume(ramp().reshape(5, 4, 6)),
    ]
    prints = {v.fingerprint for v in [volume, *different]}
    assert len(prints) == 5
    assert all(len(p) == len(hashlib.sha256().hexdigest()) for p in prints)


def test_a_narrow_range_far_from_zero_is_kept():
    values = 1e6 + np.linspace(0, 1e-3, 8).reshape(2, 2, 2)
    assert Volume(values).scalar_range == (1e6, 1e6 + 1e-3)
    with pytest.raises(VolumeError, match="too narrow"):
        Volume(values).over((1e6, 1e6 + 1e-8))


def patchy(dtype, fill):
    """A third of random voxels, of which nothing is known, hold a fill value."""
    random = np.random.default_rng(5)
    voxels = random.normal(20, 300, (17, 19, 23)).astype(dtype)
    missing = random.random(voxels.shape) < 1 / 3
    voxels[missing] = fill
    return voxels, missing


@pytest.mark.parametrize(
    ("dtype", "fill"), [("float32", 1e9), ("int16", -9999), ("int32", 2**30), ("uint8", 0)]
)
def test_missing_voxels_are_in_no_range_and_no_histogram(dtype, fill):
    voxels, missing = patchy(dtype, fill)
    volume, measured = Volume(voxels, missing=missing), voxels[~missing]
    assert volume.data_range == (measured.min(), measured.max())
    counts, edges = volume.histogram(50)
    np.testing.assert_array_equal(counts, np.histogram(measured, bins=edges)[0])
    assert counts.sum() == measured.size
    values, numbers = volume.distribution.frequencies
    np.testing.assert_array_equal(np.repeat(values, numbers), np.sort(measured))
    assert volume.missing_share == pytest.approx(missing.mean())


def test_a_sample_of_many_voxels_holds_measured_ones_only():
    voxels = np.random.default_rng(2).normal(0, 1, (80, 80, 80)).astype(np.float32)
    missing = np.ones(voxels.shape, bool)
    missing[:, 2:60, 5:79] = False
    voxels[missing] = 1000
    values, counts = Volume(voxels, missing=missing).distribution.frequencies
    assert values.max() < 10 and counts.sum() == 1 << 18
    assert np.average(values, weights=counts) == pytest.approx(0, abs=0.01)


def test_missing_voxels_go_with_the_volume():
    voxels, missing = patchy("int16", 30_000)
    volume = Volume(fill(voxels.copy(), missing), missing=missing)
    over = volume.over((-100.0, 100.0))
    assert over.missing is missing and over.hidden is missing
    drawn = over.drawing_missing(True)
    lowest = np.where(missing, voxels[~missing].min(), voxels)
    np.testing.assert_array_equal(drawn.shown, lowest)
    np.testing.assert_array_equal(drawn.drawing_missing(False).shown, volume.voxels)
    assert drawn.hidden is None and drawn.missing is missing
    assert drawn.scalar_range == over.scalar_range and drawn.data_range == volume.data_range
    assert drawn.drawing_missing(False).hidden is missing
    assert volume.fingerprint == drawn.fingerprint == Volume(lowest, missing=missing).fingerprint
    assert volume.fingerprint != Volume(voxels).fingerprint
    assert Volume(voxels, missing=np.zeros_like(missing)).missing is None


PATCHY, PATCHES = patchy("float32", 0)
STEPS = np.arange(8, dtype=np.int64).reshape(2, 2, 2)
CLOSE = "too close to one another"
REFUSED = [
    (lambda: Volume(np.zeros((4, 5))), "three axes of at least two voxels"),
    (lambda: Volume(np.zeros((1, 4, 5))), "three axes of at least two voxels"),
    (lambda: Volume(ramp("complex64")), "not real numbers"),
    (lambda: Volume(ramp(), (1, 0, 1)), "must be positive"),
    (lambda: Volume(ramp(), (1, 1, float("nan"))), "must be positive"),
    (lambda: Volume(np.array([[[0, 1], [2, np.nan]]] * 2)), "NaN or infinite"),
    (lambda: Volume(np.array([[[0, 1], [2, np.inf]]] * 2)), "NaN or infinite"),
    (lambda: Volume(1.7e308 * (STEPS / 3.5 - 1)), "span more than"),
    (lambda: Volume(2**60 + STEPS), CLOSE),
    (lambda: Volume(2**60 + 29 * STEPS), CLOSE),
    (lambda: Volume(np.linspace(0, 1e-320, 8).reshape(2, 2, 2)), CLOSE),
    (lambda: Volume(1e20 + 1e5 * STEPS), CLOSE),
    (lambda: Volume(PATCHY, missing=PATCHES[1:]), "missing voxels has shape"),
    (lambda: Volume(PATCHY, missing=PATCHES.astype(np.uint8)), "missing voxels has shape"),
    (lambda: Volume(PATCHY, missing=np.ones_like(PATCHES)), "every voxel is missing"),
    (lambda: Volume(np.where(PATCHES, np.nan, PATCHY), missing=PATCHES), "NaN"),
    (lambda: Volume(np.where(PATCHES, 0, 7)).on_scale("log"), "too few"),
]


@pytest.mark.parametrize(("build", "message"), REFUSED)
def test_what_is_no_volume_is_refused(build, message):
    with pytest.raises(VolumeError, match=message):
        build()


@pytest.mark.parametrize(
    ("chosen", "message"),
    [
        *((chosen, "not increasing")
          for chosen in ((5.0, 5.0), (6.0, 5.0), (np.nan, 5.0), (5.0, np.inf), (-1e308, 1.7e308))),
        ((0.0, 1.7e308), "too large to compute with"),
        ((-8e307, 8e307), "too large to compute with"),
        ((119.0, 130.0), "no value in common with the voxels, which lie from 0 to 119"),
        ((-9.0, 0.0), "no value in common"),
    ],
)  # fmt: skip
def test_ranges_that_show_nothing_are_refused(chosen, message):
    with pytest.raises(VolumeError, match=message):
        Volume(ramp()).over(chosen)
    with pytest.raises(VolumeError, match=message):
        Volume(ramp(), chosen_range=chosen)


def test_rays_through_a_uniform_medium_follow_beers_law():
    # Spacings whose product is 1 make the voxel size 1.
    volume = Volume(np.linspace(0.0, 1.0, 4 * 6 * 10).reshape(4, 6, 10), (0.5, 1.0, 2.0))
    rays = ThinnedVolume.of(volume).ray_opacities(OpacityTF((0.0, 1.0), points=((0.0, 0.1),)))
    lengths = np.repeat([4 * 2.0, 6 * 1.0, 10 * 0.5], [60, 40, 24])
    assert rays == pytest.approx(1 - 0.9**lengths)


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


def test_missing_voxels_show_nothing_unless_they_are_drawn():
    voxels = np.full((8, 8, 8), 200, np.uint8)
    voxels[0, 0, 0] = 250
    missing = np.zeros(voxels.shape, bool)
    missing[:, :, 3:] = True
    volume = Volume(voxels, missing=missing)
    opacity = OpacityTF((200.0, 250.0), (GaussianMode(200.0, 10.0, 0.5),))
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
