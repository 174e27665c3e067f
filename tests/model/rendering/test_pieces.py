from dataclasses import replace

import numpy as np
import pytest

from model.errors import TfscopeError
from model.rendering import pieces
from model.rendering.pieces import pieces_at, pieces_under, with_edge
from model.rendering.scale_bar import volume_text
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF
from model.scene.view import Projection, View
from model.scene.volume import FileFacts, Volume

RANGE = (0.0, 255.0)
TWO = OpacityTF(RANGE, (GaussianMode(100.0, 20.0, 0.3), GaussianMode(220.0, 30.0, 0.9)))


def volume(edge=20):
    """Two blocks of 100, one of which has a core of 220, a wire and a speck; 0 elsewhere."""
    voxels = np.zeros((edge, edge, edge), np.uint8)
    voxels[2:8, 2:8, 2:8] = 100
    voxels[3:6, 3:6, 3:6] = 220
    voxels[12:18, 2:8, 2:8] = 100
    voxels[9, 15, 3:18] = 220
    voxels[18, 18, 18] = 100
    voxels[19, 19, 0] = 255
    return Volume(voxels, (1.0, 2.0, 0.5), file=FileFacts(spacing_unit="mm")).over(RANGE)


def inputs(**others):
    return SceneInputs(View(), TWO, ColorTF(RANGE, ((0.0, 1.0, 1.0, 1.0),)), **others)


def at(z, y, x, edge=20):
    return np.array([x, y, z]) / (edge - 1)


def test_a_piece_is_what_touches_and_a_voxel_around_it():
    whole, core = pieces_at(volume(), inputs(), at(4, 4, 4))
    assert whole.count == 6**3 and whole.values is None
    expected = np.zeros((20,) * 3, bool)
    expected[1:9, 1:9, 1:9] = True
    np.testing.assert_array_equal(whole.voxels.shown, expected)
    # In the band of the core's values there is the core alone. Towards what is more opaque than the
    # band's end, the surface does not fade: there is no edge.
    assert core.count == 3**3 and core.values[0] > 150
    np.testing.assert_array_equal(core.voxels.shown[:9], volume().voxels[:9] == 220)
    shell = pieces_at(volume(), inputs(), at(2, 4, 4))[1]
    assert shell.count == 6**3 - 3**3
    np.testing.assert_array_equal(shell.voxels.shown, expected & (volume().voxels != 220))
    for piece in (whole, shell):
        assert with_edge(piece.voxels.exact, volume(), TWO) == piece.voxels
    # Around a piece there may be invisible values between those of block and core.
    narrow = OpacityTF(RANGE, tuple(replace(mode, width=5.0) for mode in TWO.modes))
    gap = volume()
    gap.voxels[1, 1:9, 1:9] = 160
    piece = pieces_at(gap, replace(inputs(), opacity_tf=narrow), at(4, 4, 4))[0]
    assert piece.count == 6**3 and with_edge(piece.voxels.exact, gap, narrow) == piece.voxels
    # What is far more opaque than the band is no edge, however near its values are.
    gap.voxels[1, 1:9, 1:9] = 130
    jump = OpacityTF(RANGE, points=((0, 0), (60, 0.1), (120, 0.1), (121, 0.9), (255, 0.9)))
    pieces_ = pieces_at(gap, replace(inputs(), opacity_tf=jump), at(2, 2, 2), [(80.0, 120.0)])
    assert pieces_[-1].values[1] < 121 and not pieces_[-1].voxels.shown[1].any()
    # Neither has what does not end where its values do.
    half = Mask.of(shell.voxels.exact.shown & (np.indices((20,) * 3)[0] < 5))
    assert with_edge(half, volume(), TWO) == half


def test_alone_and_cut_leave_what_a_mask_leaves():
    first, second = (pieces_at(volume(), inputs(), at(z, 4, 7))[0] for z in (4, 14))
    cut = first.left(None, False)
    np.testing.assert_array_equal(cut.shown, ~first.voxels.shown)
    np.testing.assert_array_equal(second.left(cut, True).shown, second.voxels.shown)
    # A piece shown alone is no larger the next time: its edge is no part of it.
    alone = first.left(None, True)
    blocks = volume().voxels
    assert pieces_at(volume(), inputs(mask=alone), at(4, 4, 7))[0].count == first.count
    np.testing.assert_array_equal(alone.exact.shown, (blocks > 0) & first.voxels.shown)
    np.testing.assert_array_equal(first.left(cut.exact.exact, False).shown, cut.shown)
    both = first.voxels.shown | second.voxels.shown
    assert not (second.left(cut, False).shown & both).any()
    with pytest.raises(TfscopeError, match="Nothing would be left"):
        first.left(cut, True)
    # Of what a mask or a crop box hides nothing is taken, nor where there is nothing.
    crop = CropBox((0.0, 0.0, 0.0), (1.0, 1.0, 5 / 19))
    for others, place, said in (
        ({"mask": cut}, (4, 4, 4), "cut away"),
        ({"crop": crop}, (9, 4, 4), "cut away"),
        ({}, (10, 10, 10), "The TF shows nothing here"),
    ):
        with pytest.raises(TfscopeError, match=said):
            pieces_at(volume(), inputs(**others), at(*place))
    piece = pieces_at(volume(), inputs(crop=crop), at(4, 4, 7))[0]
    assert piece.count == 4 * 6 * 6
    assert not piece.voxels.shown[6:].any()
    # So does a clipping plane, here halfway through the block along x.
    clip = ClipPlane((1.0, 0.0, 0.0), volume().proportions[0] * (2 * 4.5 / 19 - 1))
    piece = pieces_at(volume(), inputs(clip=clip), at(4, 4, 3))[0]
    assert piece.count == 6 * 6 * 3
    # And what is missing, with what a mask hides.
    given = Volume(volume().voxels, missing=np.indices((20,) * 3)[0] == 7).over(RANGE)
    mask = Mask.of(np.indices((20,) * 3)[1] != 2)
    assert pieces_at(given, inputs(mask=mask), at(4, 4, 7))[0].count == 5 * 5 * 6


def test_values_between_voxels_decide_about_the_band():
    """Halfway into the air a surface has a lower value, which may be one that no voxel has."""
    found = pieces_at(volume(), inputs(), at(4, 4, 7.2))
    assert found[0].count == 6**3 and found[-1].count == 6**3 - 3**3
    found = pieces_at(volume(), inputs(), at(9.45, 15, 10))
    assert [piece.count for piece in found] == [15]


def test_a_listed_band_has_a_piece_unless_it_is_the_skin_of_a_peak():
    ramp = replace(inputs(), opacity_tf=OpacityTF(RANGE, points=((50.0, 0.0), (255.0, 0.9))))
    found = pieces_at(volume(), ramp, at(4, 4, 7), [(200.0, 230.0), (90.0, 110.0)])
    assert [piece.count for piece in found] == [6**3, 6**3 - 3**3]
    assert found[1].values == pytest.approx((90.0, 110.0), abs=0.5)
    thin = volume()
    thin.voxels[4, 4, 7] = thin.voxels[4, 5, 7] = 140
    found = pieces_at(thin, inputs(), at(4, 4, 7), [(135.0, 145.0)])
    assert found[1].count == 6**3 - 3**3 and found[1].values[0] < 100


def test_under_a_pixel_the_first_listed_band_is_meant():
    # The ray meets the block's rim, then its core.
    ((right, up),) = Projection(View(), volume().proportions).places(at(4, 4, 4)[None])
    for named, count in (((90.0, 110.0), 6**3 - 3**3), ((210.0, 230.0), 3**3)):
        _, piece = pieces_under(volume(), inputs(), (right, up), [named, (90.0, 230.0)])
        assert piece.count == count and piece.values == pytest.approx(named, abs=0.5)


@pytest.mark.parametrize("edge", [20, 21])
def test_on_a_coarse_grid_pieces_are_the_same_voxels(monkeypatch, edge):
    for most in (pieces.MOST_VOXELS, 11**3):
        monkeypatch.setattr(pieces, "MOST_VOXELS", most)
        for z in (4, 14):
            piece = pieces_at(volume(edge), inputs(), at(z, 4, 4, edge))[0]
            expected = np.zeros((edge,) * 3, bool)
            expected[(slice(1, 9) if z == 4 else slice(11, 19)), 1:9, 1:9] = True
            assert piece.count == 6**3
            np.testing.assert_array_equal(piece.voxels.shown, expected)


def test_specks_by_the_thousand_and_two_slices_have_pieces():
    voxels = np.where(np.indices((24,) * 3).sum(axis=0) % 2, 0, 100).astype(np.uint8)
    specks, place = Volume(voxels).over(RANGE), at(4, 4, 4, 24)
    with pytest.raises(TfscopeError, match="too small"):
        pieces_at(specks, inputs(), place)
    # A label may be as small.
    (piece,) = pieces_at(replace(specks, file=FileFacts(is_labels=True)), inputs(), place)
    assert piece.count == 1 and piece.voxels.shown[4, 4, 4]
    assert np.count_nonzero(piece.voxels.shown) == 1
    voxels = np.zeros((2, 9, 9), np.uint8)
    voxels[:, 2:5, 2:5] = 100
    (piece,) = pieces_at(Volume(voxels).over(RANGE), inputs(), np.array([3 / 8, 3 / 8, 1.0]))
    assert piece.count == 18


@pytest.mark.parametrize(
    ("spacing", "unit", "count", "text"),
    [
        ((0.5, 0.5, 2.0), "mm", 10, "5 mm³"),
        ((1.0, 1.0, 1.0), "mm", 331_234, "331 cm³"),
        ((2.0, 2.0, 2.0), "um", 7, "56 µm³"),
        ((1e-9, 1e-9, 1e-9), "mm", 5, "5e-27 mm³"),
        ((2.0, 1.0, 1.0), "inch", 3, "6 inch³"),
        ((1.0, 1.0, 1.0), "", 1, "1 voxel"),
        ((1.0, 1.0, 1.0), "", 12_345, "12,345 voxels"),
    ],
)
def test_the_space_of_voxels_is_said_in_the_files_unit(spacing, unit, count, text):
    given = Volume(volume().voxels, spacing, file=FileFacts(spacing_unit=unit))
    assert volume_text(count, given) == text


def test_a_mask_says_of_each_voxel_whether_it_is_shown():
    shown = np.random.default_rng(0).random((3, 5, 7)) < 0.5
    mask = Mask.of(shown)
    assert mask == Mask.of(shown.copy()) != Mask.of(~shown)
    np.testing.assert_array_equal(mask.shown, shown)
    every = np.argwhere(np.ones((7, 5, 3), bool))
    np.testing.assert_array_equal(mask.shows(*every.T), shown[tuple(every.T[::-1])])
    for shape in ((2, 2, 2), (3, 5, 7)):
        assert Mask.of(np.ones(shape, bool)) is None
        bits = np.full(-(-np.prod(shape) // 8), 255, np.uint8)
        assert Mask.of_packed(shape, bits) is None
        one = np.zeros(shape, bool)
        one[-1, -1, -1] = True
        rest = Mask.of_packed(shape, bits & ~np.packbits(one))
        assert rest == Mask.of(~one)
        with pytest.raises(TfscopeError, match="Nothing would be left"):
            Mask.of(np.zeros(shape, bool))
