"""The images of a DICOM file: where each lies, what it belongs to, what its pixels mean."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from model.volume_files.checks import damaged
from model.volume_files.dicom_file import DicomFile, numbers_of, text_of, value_of

if TYPE_CHECKING:
    from pydicom import Dataset

MOST_FRAMES = 100_000
NO_UNITS = ("", "US")
PET_UNITS = {"BQML": "Bq/ml", "CNTS": "counts", "GML": "g/ml", "PROPCNTS": "", "NONE": ""}

SPACINGS = ("PixelSpacing", "NominalScannedPixelSpacing", "ImagerPixelSpacing")
"""Tags of the pixels' size, the truest first."""

TIME_FIELDS = (
    "TemporalPositionIdentifier", "TemporalPositionIndex", "TriggerTime",
    "NominalCardiacTriggerDelayTime", "NominalPercentageOfCardiacPhase", "FrameReferenceTime",
    "ActualFrameDuration",
)  # fmt: skip
CHANNEL_FIELDS = (
    "EchoNumbers", "EchoTime", "EffectiveEchoTime", "DiffusionBValue",
    "DiffusionGradientOrientation", "ComplexImageComponent", "FrameType", "ImageType",
    "ReferencedSegmentNumber", "StackID",
)  # fmt: skip
SERIES_FIELDS = ("AcquisitionNumber",)
LATE_FIELDS = ("AcquisitionTime", "ContentTime")
"""Times of the clock, which slices of one volume may differ in, too: asked last."""

WORDS = {
    "AcquisitionNumber": "acquisition", "EchoNumbers": "echo", "EchoTime": "echo time",
    "EffectiveEchoTime": "echo time", "DiffusionBValue": "b",
    "DiffusionGradientOrientation": "gradient", "ReferencedSegmentNumber": "segment",
    "StackID": "stack",
}  # fmt: skip

_NESTED = {
    "TemporalPositionIndex": "FrameContentSequence",
    "StackID": "FrameContentSequence",
    "NominalCardiacTriggerDelayTime": "CardiacSynchronizationSequence",
    "NominalPercentageOfCardiacPhase": "CardiacSynchronizationSequence",
    "EffectiveEchoTime": "MREchoSequence",
    "DiffusionBValue": "MRDiffusionSequence",
    "ComplexImageComponent": "MRImageFrameTypeSequence",
    "FrameType": "MRImageFrameTypeSequence",
    "ReferencedSegmentNumber": "SegmentIdentificationSequence",
}
"""Functional groups of multi-frame files in which fields stand."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One image of a DICOM file.

    Attributes
    ----------
    index : int
        Among the file's images, from 0.
    position : tuple of float
        Of the first pixel's centre in mm, in the patient's space (LPS); empty if unknown.
    orientation : tuple of float
        Directions of rows and columns; empty if unknown.
    spacing : tuple of float
        Of rows and columns in mm; empty if unknown.
    thickness : float or None
        Distance of slices, or else their thickness, as the file gives it.
    slope, intercept : float
        Of the rescaling to values.
    is_rescaled : bool
        Whether the file gives a rescaling.
    units : str
        Of the values; empty if unknown.
    number : float
        Of the instance.
    """

    file: DicomFile
    index: int
    groups: tuple[Dataset, ...]
    rows: int
    columns: int
    position: tuple[float, ...]
    orientation: tuple[float, ...]
    spacing: tuple[float, ...]
    thickness: float | None
    slope: float
    intercept: float
    is_rescaled: bool
    units: str
    number: float

    def field(self, name: str) -> str:
        """Return an identifying field as text, of the frame or else of the file."""
        nested = _NESTED.get(name)
        for group in self.groups:
            if nested and (found := _first_item(group, nested)) is not None:
                text = text_of(found, name)
                if name == "DiffusionGradientOrientation":
                    item = _first_item(found, "DiffusionGradientDirectionSequence")
                    text = "" if item is None else text_of(item, name)
                if text:
                    return text
        return self.file.text(name)

    @property
    def normal(self) -> tuple[float, float, float]:
        """Direction at right angles to the image."""
        axes = self.orientation or (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
        x, y, z = np.cross(axes[:3], axes[3:])
        return float(x), float(y), float(z)


def frames_of(file: DicomFile) -> list[Frame]:
    """Return the images of a file; none if it has no pixels."""
    if file.kind is None:
        return []
    count = int((numbers_of(file.tags, "NumberOfFrames") or [1.0])[0] or 1)
    per_frame = value_of(file.tags, "PerFrameFunctionalGroupsSequence") or ()
    if not 1 <= count <= MOST_FRAMES or (len(per_frame) and len(per_frame) < count):
        raise damaged(file.path, f"it claims {count} frames")
    shared = _first_item(file.tags, "SharedFunctionalGroupsSequence")
    offsets = numbers_of(file.tags, "GridFrameOffsetVector")
    return list(_frames(file, count, per_frame, shared, offsets))


def _frames(
    file: DicomFile,
    count: int,
    per_frame: Sequence[Dataset],
    shared: Dataset | None,
    offsets: list[float],
) -> Iterator[Frame]:
    tags = file.tags
    rows, columns = (int((numbers_of(tags, name) or [0])[0]) for name in ("Rows", "Columns"))
    position = _placed(tags, "ImagePositionPatient")
    orientation = _placed(tags, "ImageOrientationPatient")
    spacing = next(filter(None, (numbers_of(tags, name) for name in SPACINGS)), [])
    number = (numbers_of(tags, "InstanceNumber") or [0.0])[0]
    for index in range(count):
        groups = tuple(g for g in (per_frame[index] if per_frame else None, shared) if g)
        measures = _measures(tags, groups)
        place = _grouped(groups, "PlanePositionSequence", "ImagePositionPatient") or position
        axes = _grouped(groups, "PlaneOrientationSequence", "ImageOrientationPatient")
        axes = axes or orientation
        if count > 1 and not per_frame and len(place) == 3 and len(axes) == 6:
            step = (measures or 1.0) * index * (-1 if _goes_down(tags) else 1)
            if len(offsets) == count:
                step = offsets[index] - offsets[0]
            normal = np.cross(axes[:3], axes[3:])
            place = (np.array(place) + step * normal).tolist()
        slope, intercept, is_rescaled, units = _rescaling(file, groups)
        yield Frame(
            file,
            index,
            groups,
            rows,
            columns,
            tuple(place) if _usable(place, 3) else (),
            tuple(axes) if _usable(axes, 6) else (),
            tuple(_grouped(groups, "PixelMeasuresSequence", "PixelSpacing") or spacing),
            measures,
            slope,
            intercept,
            is_rescaled,
            units,
            number + index if count > 1 else number,
        )


def _usable(values: list[float], count: int) -> bool:
    return len(values) == count and bool(np.isfinite(values).all())


def _placed(tags: Dataset, name: str) -> list[float]:
    """Return position or orientation of the first image; nuclear medicine has the detector's."""
    found = numbers_of(tags, name)
    if found:
        return found
    detector = _first_item(tags, "DetectorInformationSequence")
    return [] if detector is None else numbers_of(detector, name)


def _goes_down(tags: Dataset) -> bool:
    """Whether frames follow each other against their normal, as nuclear medicine may have them."""
    found = numbers_of(tags, "SpacingBetweenSlices")
    return text_of(tags, "Modality") == "NM" and bool(found) and found[0] < 0


def _first_item(tags: Dataset, sequence: str) -> Dataset | None:
    items = value_of(tags, sequence)
    try:
        return items[0] if items else None
    except (TypeError, IndexError, KeyError):
        return None


def _grouped(groups: tuple[Dataset, ...], sequence: str, name: str) -> list[float]:
    """Return numbers of a functional group, of the frame's own or the shared one."""
    for group in groups:
        item = _first_item(group, sequence)
        if item is not None and (found := numbers_of(item, name)):
            return found
    return []


def _measures(tags: Dataset, groups: tuple[Dataset, ...]) -> float | None:
    """Return the distance of slices as it is given, or else their thickness."""
    for name in ("SpacingBetweenSlices", "SliceThickness"):
        found = _grouped(groups, "PixelMeasuresSequence", name) or numbers_of(tags, name)
        if found and np.isfinite(found[0]) and found[0] != 0:
            return abs(found[0])
    return None


def _rescaling(file: DicomFile, groups: tuple[Dataset, ...]) -> tuple[float, float, bool, str]:
    """Return slope, intercept, whether they are given, and the units of the values."""
    for tags in (*(_first_item(g, "PixelValueTransformationSequence") for g in groups), file.tags):
        if tags is None:
            continue
        slope, intercept = numbers_of(tags, "RescaleSlope"), numbers_of(tags, "RescaleIntercept")
        if not slope and not intercept:
            continue
        pair = (slope or [1.0])[0], (intercept or [0.0])[0]
        if pair[0] == 0 or not np.isfinite(pair).all():
            continue
        return *pair, True, _units(file, text_of(tags, "RescaleType"))
    scaling = numbers_of(file.tags, "DoseGridScaling")
    if scaling and np.isfinite(scaling[0]) and scaling[0] > 0:
        units = file.text("DoseUnits")
        return scaling[0], 0.0, True, {"GY": "Gy"}.get(units, units.lower())
    return 1.0, 0.0, False, ""


def _units(file: DicomFile, kind: str) -> str:
    """Return the units of rescaled values: those that are given, or Hounsfield's of a CT."""
    if kind not in NO_UNITS:
        return kind
    modality = file.text("Modality")
    if modality == "PT":
        units = file.text("Units")
        return PET_UNITS.get(units, units)
    is_plain = "LOCALIZER" not in file.text("ImageType").upper()
    return "HU" if modality == "CT" and kind == "" and is_plain else ""
