"""DICOM files written by pydicom, with any tags."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.encaps import encapsulate
from pydicom.uid import ExplicitVRLittleEndian

MR = "1.2.840.10008.5.1.4.1.1.4"
ENHANCED_MR = "1.2.840.10008.5.1.4.1.1.4.1"


def dataset(pixels, *, syntax=ExplicitVRLittleEndian, encoded=None, frames=0, **tags):
    """Return an image with usual tags; `tags` override them, None leaves one out."""
    ds = Dataset()
    ds.file_meta = FileMetaDataset()
    ds.file_meta.TransferSyntaxUID = syntax
    rows, columns = pixels.shape[-2:]
    bits = 8 * pixels.dtype.itemsize
    values = {
        "SOPClassUID": MR,
        "SOPInstanceUID": "1.2.3.4",
        "StudyInstanceUID": "1.2",
        "SeriesInstanceUID": "1.2.3",
        "Modality": "MR",
        "SamplesPerPixel": 1,
        "PhotometricInterpretation": "MONOCHROME2",
        "Rows": rows,
        "Columns": columns,
        "BitsAllocated": bits,
        "BitsStored": bits,
        "HighBit": bits - 1,
        "PixelRepresentation": int(pixels.dtype.kind == "i"),
        "PixelSpacing": [2.0, 0.5],
        "ImageOrientationPatient": [1, 0, 0, 0, 1, 0],
        **tags,
    }
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


def save(path: Path, ds: Dataset) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    ds.save_as(path, enforce_file_format=True)
    return path


def series(folder: Path, array, *, positions=None, start=0, each=lambda z: {}, **tags):
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
        save(folder / f"{start + z:03d}.dcm", dataset(np.ascontiguousarray(plane), **own))
    return folder


def item(**tags):
    """Return the only item of a sequence."""
    ds = Dataset()
    for name, value in tags.items():
        setattr(ds, name, value)
    return [ds]
