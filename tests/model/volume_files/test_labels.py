"""Labels and missing voxels in files, against nibabel and closed forms."""

import gzip
from pathlib import Path

import nibabel
import numpy as np
import pytest
from volume_writers import voxels as random_voxels
from volume_writers import write_itk, write_nrrd, write_ome_zarr

from model.scene.distribution import Distribution
from model.scene.labels import label_range, looks_like_labels
from model.scene.ranges import robust_range
from model.scene.volume import Label, Volume
from model.volume_files import read_volume
from model.volume_files.finish import suspected_fills
from model.volume_files.shipped import first_transfer_function

NAMED = (Label(1, "liver & bile", (0.5, 0.2, 0.0)), Label(3, "bone", (1.0, 1.0, 0.8)))


def voxels(values=(0, 1, 3, 7), dtype=np.uint8):
    """A value for each quarter along z, (8, 4, 5)."""
    return np.repeat(np.array(values, dtype), 2)[:, None, None] * np.ones((1, 4, 5), dtype)


def nifti(path, values, extension=b""):
    image = nibabel.Nifti1Image(values.transpose(2, 1, 0), np.eye(4))
    image.header["intent_code"] = 1002
    if extension:
        image.header.extensions.append(nibabel.nifti1.Nifti1Extension(30, extension))
    nibabel.save(image, path)
    return path


def workbench(folder):
    table = "".join(
        f'<Label Key="{n.value}" Red="{n.color[0]}" Green="{n.color[1]}" Blue="{n.color[2]}" '
        f'Alpha="1"><![CDATA[{n.name.replace("&", "&amp;")}]]></Label>'
        for n in NAMED
    )
    text = f"<CaretExtension><LabelTable>{table}</LabelTable></CaretExtension>"
    return nifti(folder / "wb.nii.gz", voxels(), text.encode())


def snap(folder):
    lines = [
        f'{n.value} {" ".join(f"{255 * c:.1f}" for c in n.color)} 1 1 1 "{n.name}"' for n in NAMED
    ]
    (folder / "snap.label").write_text("# ITK-SnAP Label Description File\n" + "\n".join(lines))
    return nifti(folder / "snap.nii.gz", voxels())


def slicer(folder):
    fields = ["encoding: gzip"]
    for k, n in enumerate(NAMED):
        color = " ".join(map(str, n.color))
        said = {"Name": n.name, "Color": color, "LabelValue": n.value}
        fields += [f"Segment{k}_{key}:={value}" for key, value in said.items()]
    data = gzip.compress(voxels().tobytes())
    return write_nrrd(folder / "organs.seg.nrrd", voxels(), *fields, kind="uint8", data=data)


def ome(folder):
    said = {
        "colors": [
            {"label-value": n.value, "rgba": [255 * c for c in n.color] + [255]} for n in NAMED
        ],
        "properties": [{"label-value": n.value, "name": n.name} for n in NAMED],
    }
    return write_ome_zarr(folder / "ome.zarr", {"0": voxels()}, **{"image-label": said})


@pytest.mark.parametrize("write", [workbench, snap, slicer, ome])
def test_names_and_colors_are_those_of_the_file(tmp_path, write):
    volume = read_volume(write(tmp_path))
    assert volume.file.is_labels
    for found, expected in zip(volume.file.labels, NAMED, strict=True):
        assert (found.value, found.name) == (expected.value, expected.name)
        np.testing.assert_allclose(found.color, expected.color, atol=1e-3)


def test_the_first_tf_has_handles_on_labels_and_a_color_for_each(tmp_path):
    volume = read_volume(workbench(tmp_path))
    volume = volume.over(robust_range(volume))
    tf = first_transfer_function(volume)
    assert tf.opacity.points == ((0.0, 0.0), (1.0, 1.0), (3.0, 1.0), (7.0, 1.0))
    np.testing.assert_allclose(tf.color([1.0, 3.0]), [n.color for n in NAMED], atol=1e-3)
    assert abs(tf.color([7.0]) - tf.color([1.0, 3.0])).max(axis=1).min() > 0.2


def test_a_label_around_all_others_is_a_veil(tmp_path):
    volume = read_volume(nifti(tmp_path / "body.nii", voxels((0, 1, 1, 3, 7, 1))))
    opacities = first_transfer_function(volume).opacity([0.0, 1.0, 3.0, 7.0])
    assert 0.0 < opacities[1] < 0.1
    np.testing.assert_array_equal(opacities[[0, 2, 3]], [0.0, 1.0, 1.0])
    for values in ((0, 1, 1, 1), (3, 0, 1, 1)):
        aside = read_volume(nifti(tmp_path / "aside.nii", voxels(values)))
        assert first_transfer_function(aside).opacity([1.0]) == 1.0


@pytest.mark.parametrize("last", [1, 5, 100, 127, 128, 254, 255])
def test_each_label_lies_on_a_bin_of_its_own(last):
    values = np.zeros((2, 16, 16), np.uint8)
    values.ravel()[: last + 1] = np.arange(last + 1)
    low, high = label_range(Volume(values))
    places = (np.arange(last + 1) - low) / (high - low) * 255
    np.testing.assert_allclose(places, np.rint(places), atol=1e-9)
    assert len(np.unique(np.rint(places))) == last + 1
    assert -1e-9 <= places.min() <= places.max() <= 255 + 1e-9


def test_numbers_too_large_for_a_tf_become_ranks_with_names(tmp_path):
    volume = read_volume(nifti(tmp_path / "p.nii", voxels((0, 17, 2035, 14175), np.int32)))
    np.testing.assert_array_equal(volume.voxels, voxels((0, 1, 2, 3)))
    assert [label.name for label in volume.file.labels] == ["0", "17", "2035", "14175"]
    assert volume.file.label_numbers == {0: 0, 1: 17, 2: 2035, 3: 14175}
    assert "numbered 0 to 3" in volume.notes[-1]


def test_only_a_name_and_few_whole_values_look_like_labels():
    few, many = voxels(), np.arange(200, dtype=np.uint8).reshape(2, 10, 10)
    assert looks_like_labels(Volume(few, name="patient 3 seg"))
    for values, name in ((few, "patient 3"), (many, "labels"), (few / np.float32(3), "labels")):
        assert not looks_like_labels(Volume(values, name=name))


CASES = Path(__file__).parent / "cases" / "missing"


def test_a_fill_value_that_the_file_does_not_declare_is_reported_and_kept():
    volume = read_volume(CASES / "air_and_minus9999.vti")
    assert volume.missing is None and volume.data_range == (-9999, 240)
    assert "-9999 lies far from all other values, and many voxels have it" in volume.notes[0]


@pytest.mark.parametrize("bad", [[np.nan], [np.nan, np.inf, -np.inf, np.nan]])
def test_bad_voxels_are_counted(tmp_path, bad):
    array = random_voxels("float32")
    array.ravel()[3 : 3 + len(bad)] = bad
    volume = read_volume(write_itk(tmp_path / "a.nrrd", array))
    good = np.isfinite(array)
    np.testing.assert_array_equal(volume.voxels[good], array[good])
    assert volume.data_range == (array[good].min(), array[good].max())
    (note,) = volume.notes
    assert note.startswith(f"{len(bad)} voxel") and note.endswith("NaN or infinite.")


def body(dtype, low=0.0, high=240.0, size=24):
    z, y, x = np.meshgrid(*[np.linspace(-1, 1, size)] * 3, indexing="ij")
    ball = np.clip(1.2 - np.sqrt(x * x + y * y + z * z), 0, 1)
    noise = np.random.default_rng(5).normal(0, 0.02, ball.shape)
    return (low + (high - low) * np.clip(ball + noise, 0, 1)).astype(dtype)


@pytest.mark.parametrize(
    ("dtype", "fills"),
    [
        ("float32", [-9999]), ("float32", [-9999, 1e5]), ("float32", [9.96921e36]),
        ("int16", [-32768]), ("uint16", [65535]),
    ],
)  # fmt: skip
def test_values_far_away(dtype, fills):
    array = body(dtype)
    for number, fill in enumerate(fills):
        array[number:12:4] = fill
    assert suspected_fills(Distribution(array))[-1:] == pytest.approx(fills[-1:], rel=1e-6)


@pytest.mark.parametrize(
    "make",
    [
        lambda: body("float32"),
        lambda: body("int16", -1000, 3000),
        # Metal that the scanner's range cuts off.
        lambda: np.where(np.arange(24) > 21, np.int16(3071), body("int16", -1000, 1500)),
        # A long tail that is cut off, as where metal saturates a detector.
        lambda: np.uint16(np.random.default_rng(2).lognormal(0, 3.5, (24, 24, 24)).clip(0, 6e4)),
        # Labels, and two phases.
        lambda: np.random.default_rng(1).integers(0, 5, (24, 24, 24)).astype(np.int16) * 1000,
        lambda: np.where(body("float32") > 100, 1000.0, 0.0),
        # Bytes have no room for fill values.
        lambda: np.where(body("uint8") > 200, 255, body("uint8", 0, 20)).astype(np.uint8),
        # Air around, and a few hot pixels.
        lambda: np.where(body("float32") < 100, 0.0, body("float32")),
        lambda: np.where(np.arange(24**3).reshape(24, 24, 24) == 7, 1e6, body("float32")),
    ],
)
def test_values_that_are_not_far_away(make):
    assert suspected_fills(Distribution(make())) == []
