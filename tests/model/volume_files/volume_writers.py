"""Volume files written by others than our readers: SimpleITK, VTK's writers, plain bytes."""

import warnings

import mrcfile
import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
import tifffile
import zarr
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.uid import ExplicitVRLittleEndian
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOLegacy import vtkStructuredPointsWriter
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

from model.errors import VolumeError
from model.volume_files import read_volume

MR = "1.2.840.10008.5.1.4.1.1.4"
ENHANCED_MR = "1.2.840.10008.5.1.4.1.1.4.1"
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


def write_itk(path, array, compressed=False, *, vector=False, direction=None):
    image = sitk.GetImageFromArray(array, isVector=vector)
    image.SetSpacing(SPACING)
    image.SetOrigin(ORIGIN)
    if direction is not None:
        image.SetDirection(np.asarray(direction, float).ravel().tolist())
    sitk.WriteImage(image, str(path), compressed)
    return path


def write_nrrd(path, array, *fields, data=None, kind="ushort"):
    """Write a NRRD by hand; `fields` come after type, dimension and sizes."""
    sizes = " ".join(str(n) for n in array.shape[::-1])
    lines = ["NRRD0005", "# by hand", f"type: {kind}", f"dimension: {array.ndim}"]
    said = {field.partition(":")[0] for field in fields}
    usual = ("endian: little", "encoding: raw")
    lines += [f"sizes: {sizes}", *(f for f in usual if f.partition(":")[0] not in said), *fields]
    payload = array.tobytes() if data is None else data
    path.write_bytes("\n".join(lines).encode() + b"\n\n" + payload)
    return path


def write_metaimage(path, array, *fields, kind="MET_USHORT", data=None, file="LOCAL"):
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


def write_vti(path, array, mode="Appended", compressor="None", encode=False, **kwargs):
    writer = vtkXMLImageDataWriter()
    writer.SetInputData(vtk_image(array, **kwargs))
    writer.SetFileName(str(path))
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    writer.SetEncodeAppendedData(encode)
    assert writer.Write()
    return path


def write_legacy(path, array, binary=True, **kwargs):
    writer = vtkStructuredPointsWriter()
    writer.SetInputData(vtk_image(array, **kwargs))
    writer.SetFileName(str(path))
    writer.SetFileType(2 if binary else 1)
    assert writer.Write()
    return path


def write_tiff(path, pages, **options):
    """Write page by page, as slices and stacks of most programs are."""
    with tifffile.TiffWriter(path) as writer:
        for page in pages:
            writer.write(page, photometric="minisblack", contiguous=False, metadata=None, **options)
    return path


def named(write, suffix, *arguments, **options):
    """Return a writer of files whose names end in some way."""
    return lambda path, array: write(path.with_suffix(suffix), array, *arguments, **options)


def write_npy(path, array):
    np.save(path, array)
    return path


def write_npz(path, array):
    np.savez_compressed(path, values=array, names=np.arange(3))
    return path


def write_zarr(path, array, form):
    chunks = tuple(max(n // 2, 1) for n in array.shape)
    zarr.create_array(str(path), data=array, chunks=chunks, zarr_format=form)
    return path


def write_ome_zarr(place, levels, axes="zyx", scales=(), **attributes):
    """Write levels of an image, with OME's description; `place` may be a group."""
    group = place
    if not isinstance(place, zarr.Group):
        group = zarr.open_group(str(place), mode="w", zarr_format=2)
    sets = []
    for (path, data), *more in zip(levels.items(), *([scales] if scales else []), strict=True):
        group.create_array(path, data=data, chunks=data.shape)
        sets.append({"path": path, "coordinateTransformations": more[0] if more else []})
    named = [{"name": name, **({"unit": "micrometer"} if name in "xyz" else {})} for name in axes]
    group.attrs["multiscales"] = [{"version": "0.4", "axes": named, "datasets": sets}]
    group.attrs.update(attributes)
    return place


def scaled(*scale, translation=None):
    """OME's transformations of an array."""
    found = [{"type": "scale", "scale": list(scale)}]
    if translation is not None:
        found.append({"type": "translation", "translation": list(translation)})
    return found


def write_mrc(path, array, **fields):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with mrcfile.new(path, overwrite=True) as file:
            file.set_data(array)
            file.voxel_size = SPACING
            for name, value in fields.items():
                setattr(file.header, name, value)
    return path


def dataset(pixels, *, syntax=ExplicitVRLittleEndian, encoded=None, frames=0, **tags):
    """Return an image with usual tags; `tags` override them, None leaves one out."""
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = syntax
    rows, columns = pixels.shape[-2:]
    bits = 8 * pixels.dtype.itemsize
    values = {
        "SOPClassUID": MR, "SOPInstanceUID": "1.2.3.4", "StudyInstanceUID": "1.2",
        "SeriesInstanceUID": "1.2.3", "Modality": "MR", "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2", "Rows": rows, "Columns": columns,
        "BitsAllocated": bits, "BitsStored": bits, "HighBit": bits - 1,
        "PixelRepresentation": int(pixels.dtype.kind == "i"), "PixelSpacing": [2.0, 0.5],
        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0], **tags,
    }  # fmt: skip
    if frames:
        values["NumberOfFrames"] = frames
    for name, value in values.items():
        if value is not None:
            setattr(ds, name, value)
    ds.file_meta.MediaStorageSOPClassUID = ds.SOPClassUID
    ds.file_meta.MediaStorageSOPInstanceUID = ds.SOPInstanceUID
    if encoded is None:
        ds.PixelData = pixels.tobytes()
        ds["PixelData"].VR = "OB" if bits == 8 else "OW"
    else:
        ds.PixelData = encapsulate(encoded)
        ds["PixelData"].is_undefined_length = True
        ds["PixelData"].VR = "OB"
    return ds


def save_dicom(path, ds):
    path.parent.mkdir(parents=True, exist_ok=True)
    ds.save_as(path, enforce_file_format=True)
    return path


def write_dicom(folder, array, *, positions=None, start=0, each=lambda z: {}, **tags):
    """Write one image to a file; `each` gives the tags of slice z."""
    for z, plane in enumerate(array):
        position = [10.0, -20.0, 30.0 + 3.0 * z] if positions is None else positions[z]
        own = {
            "SOPInstanceUID": f"1.2.3.4.{start + z}",
            "InstanceNumber": start + z + 1,
            "ImagePositionPatient": list(position) if position is not None else None,
            **tags,
            **each(z),
        }
        save_dicom(folder / f"{start + z:03d}.dcm", dataset(np.ascontiguousarray(plane), **own))
    return folder


def item(**tags):
    ds = Dataset()
    for name, value in tags.items():
        setattr(ds, name, value)
    return [ds]


def patched(path, changes):
    """Change numbers of a file, given as {byte: (dtype, value)}."""
    data = bytearray(path.read_bytes())
    for offset, (dtype, value) in changes.items():
        packed = np.array(value, dtype).tobytes()
        data[offset : offset + len(packed)] = packed
    path.write_bytes(data)
    return path


def refused(path, match, **options):
    """Read what must be refused with a sentence that holds some words."""
    with pytest.raises(VolumeError, match=match):
        read_volume(path, **options)


def said(volume):
    return " ".join(volume.notes)


def check(volume, array, said="", *, spacing=None, origin=None, rtol=0.0, **facts):
    """Compare a volume with what was written.

    `said` has words that its notes hold, apart by "|", or None for no notes; `facts` are
    attributes of the volume or of its file.
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
