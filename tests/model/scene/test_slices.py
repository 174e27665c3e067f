"""Slices: their pixels are the voxels that their places say, and letters are the patient's."""

import numpy as np
import pytest
import SimpleITK
from scipy.ndimage import binary_erosion

from model.scene import slices
from model.scene.clip_plane import ClipPlane
from model.scene.labels import label_range, label_tf
from model.scene.mask import Mask
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.scene.volume import FileFacts, Volume

LPS = ("L", "R", "P", "A", "S", "I")
RANGE = (0.0, 100.0)
TF = TransferFunction(
    OpacityTF(RANGE, points=((0.0, 0.0), (100.0, 1.0))),
    ColorTF(RANGE, ((0.0, 0.0, 0.0, 1.0), (100.0, 1.0, 0.0, 0.0))),
)


def volume_of(voxels, **facts):
    return Volume(np.asarray(voxels), (0.5, 2.0, 3.0), **facts)


@pytest.fixture
def volume():
    rng = np.random.default_rng(3)
    return volume_of(rng.integers(-500, 500, (4, 5, 6), dtype=np.int16))


@pytest.mark.parametrize("up", ["+z", "-z", "+y", "-x"])
@pytest.mark.parametrize("labels", [(), LPS])
def test_each_pixel_is_the_voxel_at_its_place(volume, up, labels):
    for plane in slices.planes_of(up, labels):
        place = slices.place_at(volume, (4, 1, 2))
        picture = plane.cut(volume.voxels, place)
        assert np.shares_memory(picture, volume.voxels)
        height, width = picture.shape
        for row, column in np.ndindex(picture.shape):
            at = plane.moved(place, (column / (width - 1), row / (height - 1)))
            assert plane.in_picture(at) == pytest.approx((column / (width - 1), row / (height - 1)))
            x, y, z = slices.voxel_of(volume, at)
            assert picture[row, column] == volume.voxels[z, y, x]
            assert (x, y, z)[plane.axis] == (4, 1, 2)[plane.axis]


@pytest.mark.parametrize("up", ["+z", "-y"])
def test_what_mask_and_clipping_plane_cut_away_is_known_of_each_voxel(volume, up):
    shown = np.random.default_rng(2).random(volume.voxels.shape) < 0.7
    clip, place = ClipPlane((1.0, 2.0, -1.0), 0.1), slices.place_at(volume, (4, 1, 2))
    voxels = np.stack(np.meshgrid(*map(np.arange, shown.shape), indexing="ij")[::-1], axis=-1)
    away = (voxels - (np.array([6, 5, 4]) - 1) / 2) * volume.spacing
    diagonal = np.linalg.norm((np.array([6, 5, 4]) - 1) * volume.spacing)
    beyond = away @ clip.normal > 0.1 * diagonal / 2
    assert 0.2 < beyond.mean() < 0.8
    mask = Mask.of(shown)
    for plane in slices.planes_of(up):
        assert slices.cut_away(volume, plane, place, None, None) is None
        for each in ((mask, None, ~shown), (None, clip, beyond), (mask, clip, ~shown | beyond)):
            found = slices.cut_away(volume, plane, place, *each[:2])
            np.testing.assert_array_equal(found, plane.cut(each[2], place))


@pytest.mark.parametrize(
    ("up", "labels"), [("+z", LPS), ("+z", tuple("RLAPSI")), ("-y", tuple("APISLR")), ("+z", ())]
)
def test_patients_are_seen_as_radiologists_see_them(up, labels):
    planes = slices.planes_of(up, labels)
    names, edges = (tuple(getattr(each, what) for each in planes) for what in ("name", "edges"))
    if labels:
        assert names == ("Axial", "Coronal", "Sagittal")
        assert edges == (tuple("RLPA"), tuple("RLIS"), tuple("APIS"))
    else:
        assert names == ("z", "y", "x") and edges[1] == ("−x", "+x", "−z", "+z")


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e7])
def test_places_are_those_of_another_library(volume, scale):
    turned = np.array([[0.0, 0.6, 0.8], [-1.0, 0.0, 0.0], [0.0, -0.8, 0.6]])
    spacing, origin = scale * np.array([0.5, 2.0, 3.0]), scale * np.array([-70.0, 20.0, 3.0])
    image = SimpleITK.GetImageFromArray(volume.voxels)
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(origin.tolist())
    image.SetDirection(turned.T.ravel().tolist())
    facts = FileFacts(directions=tuple(map(tuple, turned.tolist())), space="LPS")
    placed = Volume(volume.voxels, tuple(spacing), tuple(origin), file=facts)
    for voxel in ((0, 0, 0), (5, 4, 3), (2, 3, 1)):
        truth = np.array(image.TransformIndexToPhysicalPoint(voxel))
        found = slices.coordinates(placed, slices.place_at(placed, voxel))
        letters, numbers = zip(*found, strict=True)
        assert numbers == pytest.approx(np.abs(truth), rel=1e-9)
        assert letters == tuple(np.where(truth < 0, list("RAI"), list("LPS")))


def test_values_are_those_of_the_file_on_any_scale():
    missing = np.zeros((2, 3, 4), bool)
    missing[1, 2, 3] = True
    volume = volume_of(np.arange(1.0, 25.0).reshape(2, 3, 4), missing=missing)
    for shown in (volume, volume.on_scale("log"), volume.over((3.0, 4.0))):
        assert slices.stored_at(shown, slices.place_at(shown, (1, 2, 0))) == 10.0
        assert slices.stored_at(shown, (1.0, 1.0, 1.0)) is None
    assert slices.stored_at(volume.drawing_missing(True), (1.0, 1.0, 1.0)) == 1.0


@pytest.mark.parametrize("dtype", [np.uint8, np.int16, np.float32, np.float64])
def test_gray_is_the_window_and_clipped_outside(dtype):
    values = np.array([[0, 10, 20], [30, 40, 120]], dtype)
    picture = slices.SlicePaint.of((10.0, 30.0), None).picture(values)
    # Slices may lie in memory in any order.
    turned = slices.SlicePaint.of((10.0, 30.0), None).picture(values.T)
    np.testing.assert_array_equal(turned, picture.transpose(1, 0, 2))
    wanted = np.clip((values.astype(float) - 10) / 20, 0, 1) * 255
    np.testing.assert_allclose(picture[..., :3], wanted[..., None].repeat(3, 2), atol=0.5 + 1e-9)
    assert (picture[..., 3] == 255).all()


def test_colours_are_the_tfs_and_the_overlay_mixes_them_by_opacity():
    values = np.linspace(-10, 110, 60).reshape(6, 10)
    inside = np.clip(values, *RANGE)
    colors = TF.color(inside)
    gray, opacity = np.clip(inside / 50, 0, 1)[..., None], TF.opacity(inside)[..., None]
    mixed = gray * (1 - opacity) + colors * opacity
    for is_overlay, wanted in ((False, colors), (True, mixed)):
        picture = slices.SlicePaint.of((0.0, 50.0), TF, is_overlay).picture(values)
        np.testing.assert_allclose(picture[..., :3], 255 * wanted, atol=1 + is_overlay)


def test_labels_have_exactly_their_colours():
    voxels = np.arange(24, dtype=np.uint8).reshape(2, 3, 4) % 7
    volume = volume_of(voxels).over(label_range(volume_of(voxels)))
    tf = label_tf(volume)
    picture = slices.SlicePaint.of(volume.scalar_range, tf).picture(voxels[1])
    wanted = np.rint(255 * tf.color(voxels[1].astype(float)))
    np.testing.assert_array_equal(picture[..., :3], wanted)


@pytest.mark.parametrize("dtype", [np.int16, np.float32])
def test_missing_voxels_are_clear_and_a_band_is_outlined(dtype):
    rng = np.random.default_rng(1)
    values = rng.integers(0, 100, (40, 50)).astype(dtype)
    values[5:20, 10:30] = 70
    missing = rng.random(values.shape) < 0.1
    paint = slices.SlicePaint.of(RANGE, None)
    picture = paint.picture(values, missing, (59.5, 80.5), 0x0A0B0C)
    inside = (values >= 60) & (values <= 80) & ~missing
    edge = inside & ~binary_erosion(inside, border_value=1)
    assert edge.any() and (inside & ~edge).any()
    assert (picture[edge] == (10, 11, 12, 255)).all()
    assert (picture[missing] == 0).all()
    others = ~edge & ~missing
    np.testing.assert_array_equal(picture[others], paint.picture(values)[others])


def test_the_usual_window_has_nearly_all_voxels_and_a_dragged_one_stays_useful():
    values = np.random.default_rng(0).normal(size=100_000)
    counts, edges = np.histogram(values, 256)
    low, high = slices.usual_window(counts, edges)
    assert 0.995 < np.mean((values >= low) & (values <= high)) < 1
    assert slices.usual_window(np.array([0, 9, 0]), np.arange(4.0)) == (1.0, 2.0)
    assert slices.gray_window((10.0, 30.0), RANGE, 2.0, 0.25) == pytest.approx((10.0, 50.0))
    low, high = slices.gray_window((10.0, 30.0), RANGE, 0.0, 0.0)
    assert low < high and np.isfinite([low, high]).all()
    assert max(slices.gray_window((10.0, 30.0), RANGE, 1.0, 1e9)) <= 120
