"""Volume files written by others than our readers: SimpleITK, VTK's writers, plain bytes."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import mrcfile
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
import zarr
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from model.errors import VolumeError
from model.volume_files import read_volume

SPACING = (0.5, 2.0, 3.0)
ORIGIN = (10.0, -20.0, 30.0)
INTEGER_TYPES = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64"]
ALL_TYPES = [*INTEGER_TYPES, "float32", "float64"]


def voxels(dtype="uint16", shape=(6, 5, 7)):
    """Values that use the type's range, no two slices, rows or columns alike."""
    rng = np.random.default_rng(7)
    dtype = np.dtype(dtype)
    if dtype.kind == "f":
        return rng.normal(0, 1e3, shape).astype(dtype)
    info = np.iinfo(dtype)
    return rng.integers(info.min, info.max, shape, dtype=dtype, endpoint=True)


def write_itk(path: Path, array, compressed=False, *, vector=False, direction=None):
    image = sitk.GetImageFromArray(array, isVector=vector)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    if direction is not None:
        image.SetDirection(np.asarray(direction, float).ravel().tolist())
    sitk.WriteImage(image, str(path), compressed)
    return path


def write_nrrd(path: Path, array, *fields: str, data: bytes | None = None, kind="ushort"):
    """Write a NRRD by hand; `fields` come after type, dimension and sizes."""
    sizes = " ".join(str(n) for n in array.shape[::-1])
    lines = ["NRRD0005", "# by hand", f"type: {kind}", f"dimension: {array.ndim}"]
    order = [] if any(field.startswith("endian") for field in fields) else ["endian: little"]
    lines += [f"sizes: {sizes}", *order, *fields]
    payload = array.tobytes() if data is None else data
    path.write_bytes("\n".join(lines).encode() + b"\n\n" + payload)
    return path


def write_metaimage(path: Path, array, *fields: str, kind="MET_USHORT", data=None, file="LOCAL"):
    sizes = " ".join(str(n) for n in array.shape[::-1])
    lines = ["ObjectType = Image", f"NDims = {array.ndim}", f"DimSize = {sizes}"]
    lines += [f"ElementType = {kind}", *fields, f"ElementDataFile = {file}", ""]
    payload = array.tobytes() if data is None else data
    path.write_bytes("\n".join(lines).encode() + payload)
    return path


def vtk_image(array, components=1):
    image = vtkImageData()
    image.SetDimensions(*array.shape[2::-1])
    image.SetSpacing(*SPACING)
    image.SetOrigin(*ORIGIN)
    scalars = numpy_to_vtk(array.reshape(-1, components) if components > 1 else array.ravel(), 1)
    scalars.SetName("density")
    image.GetPointData().SetScalars(scalars)
    return image


def write_vti(path: Path, array, mode="Appended", compressor="None", encode=False, **kwargs):
    writer = vtkXMLImageDataWriter()
    writer.SetInputData(vtk_image(array, **kwargs))
    writer.SetFileName(str(path))
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.SetEncodeAppendedData(encode)
    assert writer.Write()
    return path


def write_legacy(path: Path, array, binary=True, **kwargs):
    writer = vtkStructuredPointsWriter()
    writer.SetInputData(vtk_image(array, **kwargs))
    writer.SetFileName(str(path))
    writer.SetFileType(2 if binary else 1)
    assert writer.Write()
    return path


def write_tiff(path: Path, pages, order="<", description=b"", resolution=None, fields=()):
    """Write a plain TIFF by hand: one strip per page; `fields` are extra (tag, value) shorts."""
    magic = {"<": b"II", ">": b"MM"}[order]
    out = bytearray(magic + struct.pack(order + "HI", 42, 0))
    link = 4
    for page in pages:
        strip = len(out)
        out += page.astype(page.dtype.newbyteorder(order)).tobytes()
        out += b"\0" * (len(out) % 2)
        notes = len(out)
        out += description + b"\0" * (len(description) % 2)
        ratios = len(out)
        for value in resolution or ():
            out += struct.pack(order + "II", round(value * 1000), 1000)
        shorts = {258: page.dtype.itemsize * 8, 259: 1, 262: 1, 277: 1, **dict(fields)}
        shorts[339] = {"u": 1, "i": 2, "f": 3}[page.dtype.kind]
        entries = [(256, 4, 1, page.shape[1]), (257, 4, 1, page.shape[0]), (273, 4, 1, strip)]
        entries += [(278, 4, 1, page.shape[0]), (279, 4, 1, page.nbytes)]
        entries += [(tag, 3, 1, value) for tag, value in shorts.items()]
        if description:
            entries.append((270, 2, len(description), notes))
        if resolution:
            entries += [(282, 5, 1, ratios), (283, 5, 1, ratios + 8)]
        out[link : link + 4] = struct.pack(order + "I", len(out))
        out += struct.pack(order + "H", len(entries))
        for tag, kind, count, value in sorted(entries):
            short = struct.pack(order + "HH", value, 0) if kind == 3 else b""
            out += struct.pack(order + "HHI", tag, kind, count)
            out += short or struct.pack(order + "I", value)
        link = len(out)
        out += b"\0" * 4
    path.write_bytes(out)
    return path


def write_npy(path: Path, array):
    np.save(path, array)
    return path


def write_npz(path: Path, array):
    np.savez_compressed(path, values=array, names=np.arange(3))
    return path


def write_zarr(path: Path, array, form: int):
    chunks = tuple(max(n // 2, 1) for n in array.shape)
    zarr.create_array(str(path), data=array, chunks=chunks, zarr_format=form)
    return path


def write_mrc(path: Path, array, **fields):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with mrcfile.new(path, overwrite=True) as file:
            file.set_data(array)
            file.voxel_size = SPACING
            for name, value in fields.items():
                setattr(file.header, name, value)
    return path


def write_dicom(folder: Path, array, *, series="1.2.3", names=None, heights=None, **tags):
    """Write a series by SimpleITK; `tags` such as t0028_1053="2" override."""
    folder.mkdir(exist_ok=True)
    writer = sitk.ImageFileWriter()
    writer.KeepOriginalImageUIDOn()
    step = SPACING[2]
    for z, plane in enumerate(array):
        image = sitk.GetImageFromArray(plane)
        image.SetSpacing(SPACING[:2])
        height = ORIGIN[2] + step * z if heights is None else heights[z]
        values = {
            "t0008_0060": "CT",
            "t0020_000d": "1.2",
            "t0020_000e": series,
            "t0008_0018": f"{series}.{z + 1}",
            "t0020_0032": f"{ORIGIN[0]}\\{ORIGIN[1]}\\{height}",
            "t0020_0037": "1\\0\\0\\0\\1\\0",
            "t0020_0013": str(z + 1),
            **tags,
        }
        for tag, value in values.items():
            image.SetMetaData(tag[1:].replace("_", "|"), value)
        file = folder / f"{series}.{z:03d}.dcm"
        writer.SetFileName(str(file))
        writer.Execute(image)
        file.rename(folder / (f"{z:03d}.dcm" if names is None else names[z]))
    return folder


def refused(path, match, **options):
    """Read what must be refused with a sentence that holds some words."""
    with pytest.raises(VolumeError, match=match):
        read_volume(path, **options)


def check(volume, array, said="", *, spacing=None, origin=None, rtol=0.0, **facts):
    """Compare a volume with what was written.

    Parameters
    ----------
    said : str or None
        Words that its notes hold, apart by "|"; None for no notes.
    facts
        Attributes of the volume or of its file.
    """
    if rtol:
        np.testing.assert_allclose(volume.voxels, array, rtol=rtol)
    else:
        np.testing.assert_array_equal(volume.voxels, array)
    if spacing is not None:
        assert volume.spacing == pytest.approx(spacing)
    if origin is not None:
        assert volume.origin == pytest.approx(origin)
    notes = " ".join(volume.notes)
    assert all(words in notes for words in (said or "").split("|")), notes
    assert said is not None or not volume.notes
    owners = (volume, volume.file)
    found = {name: getattr(owners[not hasattr(volume, name)], name) for name in facts}
    assert found == facts
