import hashlib
import subprocess
import sys
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
import tifffile
import volume_writers as files
from volume_writers import ORIGIN, SPACING, check, named, voxels

from model.scene.default_tf import default_transfer_function
from model.scene.volume import Volume
from model.volume_files import Choice, RawLayout, read_volume
from model.volume_files.blocks import ReadingCancelledError, watched
from model.volume_files.raw import guess_layout, preview
from model.volume_files.shipped import first_transfer_function, picture_of, shipped_volumes

ROOT = Path(__file__).parents[3]
SHIPPED = {
    "reacting_jet_temperature_112x112x192_float32.nrrd": (
        ("reacting jet temperature", (112, 112, 192), (1, 1, 1)),
        "3804755c4ea48bdc14dc1f34b9337680c4bb65143574bea81f22e308a9fdb3af"),
    "lidc_chest_256x256x133_int16.nrrd": (("lidc chest", (256, 256, 133), (1.40625, 1.40625, 2.5)),
        "7f0a6d4d3fa63a51e95272f565bed928d1c5add4bb6a2f182d0b46aa2858bf98"),
    "fly_212x232x144_uint8.nrrd": (("fly", (212, 232, 144), (1, 1, 1)),
        "2a2ce9861d925d7f2a35ee1e9eb8c007f7b5da6614d6f2e5c556d39073c7ffd6"),
    "shell_116x48x225_uint8.nrrd": (("shell", (116, 48, 225), (1, 1, 1)),
        "ff2a3d1687fc869eabaeb70e8907db5ecac3f8ccae3774913e159d927f9b590f"),
}  # fmt: skip


@pytest.mark.parametrize("file", SHIPPED)
def test_shipped_volumes_have_the_voxels_that_were_published(file):
    facts, sha256 = SHIPPED[file]
    volume = read_volume(ROOT / "resources" / "volumes" / file)
    assert (volume.name, volume.dimensions, volume.spacing) == facts
    assert volume.notes == ()
    assert hashlib.sha256(volume.voxels.tobytes()).hexdigest() == sha256


def test_importing_the_readers_imports_no_library_of_a_format():
    names = (
        "vtkmodules", "tifffile", "pydicom", "nibabel", "mrcfile", "h5py", "zarr", "scipy",
        "xarray", "pandas",
    )  # fmt: skip
    code = f"import sys, model.volume_files; print(any(n in sys.modules for n in {names}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout.strip() == "False"


# --- types --------------------------------------------------------------------------------


def raw(order):
    def write(path, array):
        layout = RawLayout((7, 5, 6), array.dtype.name, order, SPACING)
        path = path.with_name(f"a_{layout.text}.raw")
        path.write_bytes(array.astype(layout.dtype).tobytes())
        return path

    return write


ITK = (".nrrd", ".nhdr", ".mha", ".mhd")
COMPRESSED = (named(files.write_itk, suffix, compressed=True) for suffix in ITK)
WRITERS = {f"{suffix} compressed": write for suffix, write in zip(ITK, COMPRESSED, strict=True)}
WRITERS |= {suffix: named(files.write_itk, suffix) for suffix in (*ITK, ".nii", ".nii.gz")}
WRITERS |= {".vti": named(files.write_vti, ".vti"), ".vtk": named(files.write_legacy, ".vtk")}
WRITERS |= {f"raw {order}": raw(order) for order in ("little", "big")}


@pytest.mark.parametrize("dtype", files.ALL_TYPES)
@pytest.mark.parametrize("form", WRITERS)
def test_every_type_comes_back_as_it_was_written(tmp_path, monkeypatch, form, dtype):
    monkeypatch.setattr("model.volume_files.blocks.PIECE", 100)
    volume = read_volume(WRITERS[form](tmp_path / "a", voxels(dtype)))
    # NIfTI counts x and y the other way round (RAS against SimpleITK's LPS).
    origin = (-10.0, 20.0, 30.0) if ".nii" in form else (0, 0, 0) if "raw" in form else ORIGIN
    check(volume, voxels(dtype), None, spacing=SPACING, origin=origin, name="a")
    assert volume.voxels.dtype == dtype and volume.voxels.dtype.isnative
    assert volume.voxels.flags.c_contiguous
    assert all(type(number) is float for number in volume.spacing + volume.origin)


@pytest.mark.parametrize(
    ("dtype", "low"), [("int64", 2**60), ("int64", -(2**62)), ("uint64", 2**64 - 1000)]
)
@pytest.mark.parametrize("step", [1, 3])
def test_integers_far_from_0_are_told_apart(tmp_path, dtype, low, step):
    """As counters and times in nanoseconds are: floats are 256 apart at 2^60."""
    steps = step * np.arange(4 * 5 * 6).reshape(4, 5, 6)
    stored = np.array([low + int(s) for s in steps.ravel()], dtype).reshape(steps.shape)
    path = tmp_path / f"a_6x5x4_{dtype}_little.raw"
    path.write_bytes(stored.tobytes())
    check(read_volume(path), steps, f"{low} is subtracted from all values")
    # Where floats can, nothing is changed.
    path.write_bytes((1000 * steps).astype(dtype).tobytes())
    assert read_volume(path).data_range == (0.0, 1000.0 * steps.max())


# --- raw ----------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "layout", "readable"), [
    ("engine_256x256x110_uint8", RawLayout((256, 256, 110), "uint8"), "engine"),
    ("my_CT-head_7x5x6_int16_be", RawLayout((7, 5, 6), "int16", "big"), "my CT-head"),
    ("7x5x6.float32.little", RawLayout((7, 5, 6), "float32"), "7x5x6.float32.little"),
    ("foot-7X5X6-ushort-bigendian", RawLayout((7, 5, 6), "ushort", "big"), "foot"),
    ("a_7x5x6_int16 skip=352", RawLayout((7, 5, 6), "int16", offset=352), "a"),
    ("engine_256x256_uint8", None, "engine 256x256 uint8"),
    ("a_7x5x6_int16 spacing=1,e,2", None, "a"),
])  # fmt: skip
def test_layout_and_name_from_the_file_name(tmp_path, name, layout, readable):
    assert RawLayout.parse(name) == layout
    assert read_volume(files.write_itk(tmp_path / f"{name}.nrrd", voxels())).name == readable


# --- components, description --------------------------------------------------------------

VECTORS = voxels("float32", (6, 5, 7, 3))


def vector_nrrd(path, first):
    array = VECTORS if first else np.ascontiguousarray(np.moveaxis(VECTORS, -1, 0))
    kinds = "vector domain domain domain" if first else "domain domain domain list"
    return files.write_nrrd(path, array, f"kinds: {kinds}", kind="float")


def vector_tiff(path, config):
    array = VECTORS if config == "contig" else np.moveaxis(VECTORS, -1, 1)
    tifffile.imwrite(path, array, photometric="rgb", planarconfig=config)
    return path


VECTOR_FILES = {
    "contig.tif": lambda path: vector_tiff(path, "contig"),
    "separate.tif": lambda path: vector_tiff(path, "separate"),
    "c.npy": lambda path: files.write_npy(path, VECTORS),
    "fortran.npy": lambda path: files.write_npy(path, np.asfortranarray(VECTORS)),
    "first.nrrd": lambda path: vector_nrrd(path, True),
    "last.nrrd": lambda path: vector_nrrd(path, False),
    "itk.nrrd": lambda path: files.write_itk(path, VECTORS, vector=True),
    "itk.mha": lambda path: files.write_itk(path, VECTORS, vector=True),
    "itk.nii": lambda path: files.write_itk(path, VECTORS, vector=True),
    "vtk.vti": lambda path: files.write_vti(path, VECTORS, components=3),
    "vtk.vtk": lambda path: files.write_legacy(path, VECTORS, components=3),
}


@pytest.mark.parametrize("component", [None, 0, 2, "magnitude"])
@pytest.mark.parametrize("file", VECTOR_FILES)
def test_one_component_of_several(tmp_path, file, component):
    choice = Choice(component=None if component is None else str(component))
    volume = read_volume(VECTOR_FILES[file](tmp_path / file), choice=choice)
    read = "magnitude" if component is None else component
    expected = np.linalg.norm(VECTORS, axis=-1) if read == "magnitude" else VECTORS[..., read]
    np.testing.assert_allclose(volume.voxels, expected, rtol=1e-6)
    assert volume.voxels.flags.c_contiguous
    listed = [content for content in volume.file.contents if content.kind == "component"]
    assert [content.name for content in listed] == ["0", "1", "2", "magnitude"]
    assert [content.name for content in listed if content.is_read] == [str(read)]
    said = "Every voxel has 3 components; their magnitude is read"
    assert (said in " ".join(volume.notes)) == (component is None)


# --- where voxels lie ---------------------------------------------------------------------


def any_grid(rng, array):
    """An image that is turned, mirrored or oblique."""
    if rng.random() < 0.5:
        directions = np.eye(3)[rng.permutation(3)]
    else:
        directions, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    image = sitk.GetImageFromArray(array)
    image.SetSpacing(tuple(rng.uniform(0.3, 3, 3)))
    image.SetOrigin(tuple(rng.uniform(-50, 50, 3)))
    image.SetDirection(tuple((directions * rng.choice([-1, 1], 3)).ravel()))
    return image


@pytest.mark.parametrize("suffix", [".nrrd", ".mha", ".nii", ".nii.gz"])
def test_every_voxel_lies_where_itk_has_it_and_none_is_mirrored(tmp_path, suffix):
    rng = np.random.default_rng(3)
    path = tmp_path / f"a{suffix}"
    for _ in range(12):
        image = any_grid(rng, voxels())
        sitk.WriteImage(image, str(path))
        volume = read_volume(path)
        directions = np.array(volume.file.directions)
        assert np.linalg.det(directions) > 0
        # NIfTI's space is RAS, ITK's LPS.
        signs = (-1, -1, 1) if ".nii" in suffix else (1, 1, 1)
        for x, y, z in rng.integers(0, volume.dimensions, (8, 3)):
            steps = (x, y, z) * np.array(volume.spacing)
            place = (np.array(volume.origin) + steps @ directions) * signs
            there = image[image.TransformPhysicalPointToIndex(place.tolist())]
            assert there == volume.voxels[z, y, x]


TURNED = {
    "upright": np.eye(3),
    "sagittal": np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    "from the feet": np.diag([-1, 1, -1]),
    "oblique": np.array([[0.8, 0, -0.6], [0.6, 0, 0.8], [0, -1, 0]]),
}


@pytest.mark.parametrize("suffix", [".nrrd", ".mha", ".nii"])
@pytest.mark.parametrize("name", TURNED)
def test_labels_are_itks(tmp_path, name, suffix):
    path = files.write_itk(tmp_path / f"a{suffix}", voxels(), direction=TURNED[name])
    volume = read_volume(path)
    turned = TURNED[name].astype(float).ravel()
    # ITK's letters say where an axis goes.
    code = sitk.DICOMOrientImageFilter.GetOrientationFromDirectionCosines(turned)
    opposite = dict(zip("RLAPSI", "LRPAIS", strict=True))
    assert volume.axis_labels == tuple(x for letter in code for x in (letter, opposite[letter]))
    assert volume.axis_labels[("+x", "-x", "+y", "-y", "+z", "-z").index(volume.up)] == "S"
    assert any("oblique" in note for note in volume.notes) == (name == "oblique")


STEPS = np.array([[0.5, 0, 0], [0, 2.0, 0], [0.3, -1.0, 3.0]])


def places(shape, steps, origin):
    z, y, x = np.meshgrid(*(np.arange(n) for n in shape), indexing="ij")
    return np.stack([x, y, z], axis=-1) @ steps + origin


def field(place):
    """Values at places, shape (..., 3), that linear interpolation reproduces."""
    return 1000 + place @ [3.0, 7.0, 11.0]


@pytest.mark.parametrize("kind", ["a.nii", "ct"])
def test_shifted_slices_are_where_they_were_taken(tmp_path, kind):
    """Of a grid whose slices are shifted against one another, as by a tilted gantry."""
    array = np.rint(field(places((6, 12, 16), STEPS, ORIGIN))).astype(np.int16)
    if kind == "ct":
        starts = ORIGIN + np.arange(6)[:, None] * STEPS[2]
        files.write_dicom(tmp_path / kind, array, positions=starts.tolist())
    else:
        affine = np.eye(4)
        affine[:3, :3], affine[:3, 3] = STEPS.T, ORIGIN
        image = nib.Nifti1Image(np.ascontiguousarray(array.T), None)
        image.set_sform(affine, 1)
        nib.save(image, tmp_path / kind)
    volume = read_volume(tmp_path / kind)
    assert volume.spacing == pytest.approx((0.5, 2.0, 3.0))
    there = ~volume.missing
    # Interpolation needs both neighbors: each slice loses a row and a column at most.
    assert there.sum() >= 6 * 11 * 15
    at = places(volume.voxels.shape, np.diag(volume.spacing), np.array(volume.origin))
    np.testing.assert_allclose(volume.voxels[there], field(at)[there], atol=1)
    assert any("sheared back" in note for note in volume.notes)
    assert not any("right angles" in note for note in volume.notes)


# --- TIFF, plain --------------------------------------------------------------------------


@pytest.fixture
def folders(tmp_path):
    files.write_dicom(tmp_path / "dicom", voxels())
    (tmp_path / "tiff").mkdir()
    for z, plane in enumerate(voxels()):
        tifffile.imwrite(tmp_path / "tiff" / f"{z}.tif", plane)
    return tmp_path


@pytest.mark.parametrize("kind", ["dicom", "tiff"])
def test_every_slice_is_reported(folders, kind):
    reported = []
    with watched(lambda *progress: reported.append(progress)):
        volume = read_volume(folders / kind)
    np.testing.assert_array_equal(volume.voxels, voxels())
    count = len(voxels())
    expected = [("slices read", done, count) for done in range(count)]
    assert [p for p in reported if p[0] == "slices read" and p[2] == count] == expected
    assert ("files listed", 0, count) in reported or kind == "tiff"
    before = len(reported)
    read_volume(folders / kind)
    assert len(reported) == before


@pytest.mark.parametrize("kind", ["dicom", "tiff"])
def test_a_listener_ends_it(folders, kind):
    def stop(what, done, count):
        if done == 2:
            raise ReadingCancelledError("enough")

    with watched(stop), pytest.raises(ReadingCancelledError):
        read_volume(folders / kind)


@pytest.mark.parametrize(
    ("name", "size", "layout"),
    [
        ("noise_64x16_16bit", 2**16, RawLayout((64, 16, 32), "uint16")),
        ("noise_8x64x64_u16_be", 2**16, RawLayout((8, 64, 64), "uint16", "big")),
        ("noise_float", 4 * 30**3, RawLayout((30, 30, 30), "float32")),
        ("noise", 31**3, RawLayout((31, 31, 31), "uint8")),
        # Bytes, or doubles.
        ("noise", 32**3, None),
        ("noise_32", 32**3, RawLayout((32, 32, 32), "uint8")),
        ("data_20x24x16_ushort_big", 2 * 20 * 24 * 16, RawLayout((20, 24, 16), "ushort", "big")),
        ("scan_28x20x12_u16", 512 + 2 * 6720, RawLayout((28, 20, 12), "uint16", offset=512)),
        ("scan_28x20x12_u16", 9, RawLayout((28, 20, 12), "uint16")),
        ("prime", 0, None),
    ],
)
def test_name_and_size_give_the_layout(name, size, layout):
    assert guess_layout(Path(f"{name}.raw"), size) == layout


def test_previews_are_the_middle_slices_with_z_upwards(tmp_path):
    voxels = np.arange(6 * 7 * 8, dtype=">i4").reshape(6, 7, 8)
    path = tmp_path / "data.raw"
    path.write_bytes(voxels.tobytes())
    layout = RawLayout((8, 7, 6), "int32", "big")
    for axis, expected in enumerate((voxels[::-1, :, 4], voxels[::-1, 3], voxels[3])):
        low, high = np.percentile(expected, (1, 99))
        unit = np.clip((expected - low) / (high - low), 0, 1)
        np.testing.assert_allclose(preview(path, layout, axis), 255 * unit, atol=0.51)


def test_each_volume_in_resources_is_offered_with_a_picture():
    folder = shipped_volumes()[0].parent
    assert set(shipped_volumes()) == set(folder.glob("*.nrrd"))
    assert all(picture_of(path).is_file() for path in shipped_volumes())


def scan(scale=1.0, shift=0.0, noise=20.0):
    """A body of fat about soft tissue about bone in air: HU of known tissues, on another scale."""
    random = np.random.default_rng(0)
    radius = np.linalg.norm(np.indices((64, 64, 64)) - 31.5, axis=0)
    hu = np.select([radius < 9, radius < 20, radius < 26], [800.0, 50.0, -100.0], -1000.0)
    hu += random.normal(0.0, noise, hu.shape) * np.where(radius < 9, 8.0, 1.0)
    return np.clip((hu - shift) * scale, 0 if scale < 1 else -1024, 255 if scale < 1 else 3071)


@pytest.mark.parametrize("units", ["HU", ""])
def test_scans_in_hounsfield_units_show_bone_before_soft_tissue_before_air(units):
    values = np.linspace(-1024, 3071, 4096).astype(np.int16).reshape(16, 16, 16)
    volume = Volume(values, name="scan", units=units)
    opacity = first_transfer_function(volume).opacity
    assert opacity.scalar_range == volume.scalar_range
    air, tissue, contrast, bone = opacity(np.array([-1000.0, 80.0, 280.0, 700.0]))
    assert air == 0 < tissue < 0.05 < contrast < 0.3 < 0.8 < bone


@pytest.mark.parametrize(("scale", "shift"), [(0.1, -1000.0), (0.08, -1100.0), (0.14, -1050.0)])
def test_scans_of_bytes_are_shown_by_the_peaks_of_air_fat_and_soft_tissue(scale, shift):
    volume = Volume(np.rint(scan(scale, shift)).astype(np.uint8))
    opacity = first_transfer_function(volume).opacity
    designed = first_transfer_function(Volume(np.rint(scan()).astype(np.int16), units="HU")).opacity
    for hu in (-1000.0, -500.0, 0.0, 600.0):
        # Peaks are found to about two steps.
        near = designed(np.linspace(hu - 40, hu + 40, 81))
        assert near.min() <= opacity((hu - shift) * scale) <= near.max()


def test_other_volumes_are_shown_by_their_histogram():
    values = np.linspace(-1024, 3071, 4096).astype(np.int16).reshape(16, 16, 16)
    hollow = np.linalg.norm(np.indices((32, 32, 32)) - 15.5, axis=0)
    wall = np.where(np.abs(hollow - 10) < 3, 150.0, 20.0)
    wall += np.random.default_rng(0).normal(0, 5, wall.shape)
    # Of another unit, of fractions, of two materials; in HU, without anything that is dense enough.
    others = (Volume(values, units="K"), Volume(values / 1.5), Volume(wall))
    for volume in (*others, Volume(values // 30, units="HU")):
        assert first_transfer_function(volume) == default_transfer_function(volume)
