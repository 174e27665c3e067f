from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk  # noqa: N813
from volume_writers import voxels, write_dicom, write_itk, write_metaimage, write_nrrd

from model.volume_files import describe, read_volume

TURNED = {
    "upright": np.eye(3),
    "sagittal": np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]]),
    "from the feet": np.diag([-1, 1, -1]),
    "oblique": np.array([[0.8, 0, -0.6], [0.6, 0, 0.8], [0, -1, 0]]),
}


def itk_labels(direction: np.ndarray) -> tuple[str, ...]:
    """Labels by ITK, whose letters say where an axis goes."""
    code = sitk.DICOMOrientImageFilter.GetOrientationFromDirectionCosines(direction.ravel())
    opposite = dict(zip("RLAPSI", "LRPAIS", strict=True))
    return tuple(label for letter in code for label in (letter, opposite[letter]))


@pytest.mark.parametrize("suffix", [".nrrd", ".mha", ".nii"])
@pytest.mark.parametrize("name", TURNED)
def test_labels_are_itks(tmp_path: Path, name: str, suffix: str) -> None:
    path = write_itk(tmp_path / f"a{suffix}", voxels(), direction=TURNED[name])
    volume = read_volume(path)
    assert volume.axis_labels == itk_labels(TURNED[name].astype(float))
    assert volume.axis_labels[("+x", "-x", "+y", "-y", "+z", "-z").index(volume.up)] == "S"


def test_labels_of_a_dicom_series(tmp_path: Path) -> None:
    array = voxels("int16")
    assert read_volume(write_dicom(tmp_path / "axial", array)).axis_labels == tuple("LRPASI")
    # Rows towards the back, columns towards the feet, later slices farther to the left.
    sagittal = tmp_path / "sagittal"
    for number in range(len(array)):
        write_dicom(
            sagittal,
            array[number : number + 1],
            names=[f"{number}.dcm"],
            t0008_0018=f"1.2.3.{number}",
            t0020_0032=f"{10 * number}\\0\\0",
            t0020_0037="0\\1\\0\\0\\0\\-1",
        )
    volume = read_volume(sagittal)
    assert volume.axis_labels == tuple("PAISRL")
    assert volume.up == "-y"
    np.testing.assert_array_equal(volume.scalars, array[::-1])


def test_a_reversed_nifti_is_labelled_as_it_is_shown(tmp_path: Path) -> None:
    path = write_itk(tmp_path / "a.nii", voxels())
    header = bytearray(path.read_bytes())
    header[76:80] = np.float32(-1).tobytes()
    header[254:256] = np.int16(0).tobytes()
    path.write_bytes(header)
    volume = read_volume(path)
    np.testing.assert_array_equal(volume.scalars, voxels()[::-1])
    # A left-handed file of superior slices first, read in reverse.
    assert volume.axis_labels == tuple("LRPASI")


@pytest.mark.parametrize(
    ("space", "labels"),
    [
        ("left-posterior-superior", "LRPASI"),
        ("RAS", "RLAPSI"),
        # Left-handed: read from the head down, so that it is not mirrored.
        ("left-anterior-superior", "LRAPIS"),
        ("3D-right-handed", ""),
        ("scanner-xyz", ""),
    ],
)
def test_spaces_of_nrrd(tmp_path: Path, space: str, labels: str) -> None:
    fields = ["encoding: raw", f"space: {space}", "space directions: (1,0,0) (0,1,0) (0,0,1)"]
    volume = read_volume(write_nrrd(tmp_path / "a.nrrd", voxels(), *fields))
    assert volume.axis_labels == tuple(labels)
    up = {"S": "+z", "I": "-z"}
    assert volume.up == (up[labels[4]] if labels else "")


@pytest.mark.parametrize(
    ("fields", "labels"),
    [
        (["AnatomicalOrientation = RAI"], "LRPASI"),
        (["AnatomicalOrientation = ASL"], "PAISRL"),
        (["AnatomicalOrientation = ???", "TransformMatrix = 1 0 0 0 1 0 0 0 1"], ""),
        ([], ""),
    ],
)
def test_letters_of_metaimage(tmp_path: Path, fields: list[str], labels: str) -> None:
    volume = read_volume(write_metaimage(tmp_path / "a.mha", voxels(), *fields))
    assert volume.axis_labels == tuple(labels)
    assert (("axes point to", "L, P, S of the patient") in describe(volume)) == (labels == "LRPASI")


def test_plain_grids_have_no_labels(tmp_path: Path) -> None:
    volume = read_volume(write_nrrd(tmp_path / "a.nrrd", voxels(), "encoding: raw"))
    assert (volume.axis_labels, volume.up) == ((), "")
    broken = ["encoding: raw", "space: LPS", "space directions: (0,0,0) (0,1,0) (0,0,1)"]
    assert read_volume(write_nrrd(tmp_path / "b.nrrd", voxels(), *broken)).up == ""
