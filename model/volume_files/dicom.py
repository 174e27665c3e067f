"""DICOM series, given as a folder or by any one of its files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from model.errors import VolumeError
from model.scene.volume import Content
from model.volume_files.checks import log_of, slices_in, truncated, unsupported
from model.volume_files.choice import LARGEST, Choice, choice_notes, chosen_index
from model.volume_files.dicom_stack import Stack, stacks_of
from model.volume_files.dicom_tags import (
    DicomFile,
    Frame,
    frames_of,
    is_dicom,
    numbers_of,
    read_dicom_file,
)
from model.volume_files.dicom_volume import read_stack, value_type
from model.volume_files.grid import Grid
from model.volume_files.progress import counted

SUFFIXES = (".dcm", ".dicom", ".ima")


def dicom_slices(folder: Path) -> list[Path]:
    """Return the files of a folder that have a DICOM suffix or DICOM content, sorted by name."""
    files = sorted(slices_in(folder, SUFFIXES))
    return [
        path
        for path in files
        if path.name.upper() != "DICOMDIR" and (path.suffix.lower() in SUFFIXES or is_dicom(path))
    ]


def list_dicom(files: Sequence[Path]) -> tuple[list[Stack], tuple[str, ...]]:
    """Find the volumes in DICOM files by their tags, the largest first; also return notes."""
    read = [read_dicom_file(path) for path in counted("files listed", files)]
    images = [file for file in read if file.kind is not None]
    others = [file for file in read if file.kind is None]
    classes = {file.text("SOPClassUID") for file in images}
    for file in others:
        # Of a file that was cut off there may be only the beginning of its class.
        begun = (file.text("SOPClassUID"), file.meta_text("MediaStorageSOPClassUID"))
        is_image = any(each.startswith(part) for each in classes for part in begun)
        is_image |= not classes and any(_is_image_class(part) for part in begun)
        if "Rows" in file.tags or is_image:
            raise truncated(file.path, "it has no pixels")
    notes: tuple[str, ...] = ()
    if others:
        notes = (f"DICOM files without an image were left out: {len(others)}.",)
    if not images:
        raise VolumeError(
            f"{files[0].parent}: no DICOM file here holds an image; choose another folder."
        )
    images, copies = _without_copies(images)
    if copies:
        notes += (f"Files with the same image as another were left out: {copies}.",)
    return stacks_of([frame for file in images for frame in frames_of(file)]), notes


def read_dicom(
    files: Sequence[Path],
    like: Path | None = None,
    choice: Choice = LARGEST,
) -> Grid:
    """Read one volume from the files of a folder: that of the file `like`, or else the largest."""
    with log_of("pydicom"):
        return _read(files, like, choice)


def _read(files: Sequence[Path], like: Path | None, choice: Choice) -> Grid:
    folder = files[0].parent
    stacks, notes = list_dicom(files)
    if like is not None and choice.series is None:
        own = [s for s in stacks if any(frame.file.path == like for frame in s.frames)]
        stacks = own + [stack for stack in stacks if stack not in own]
    volumes = [stack for stack in stacks if len(stack.frames) > 1 and _is_grey(stack.frames[0])]
    if like is not None and choice.series is None and stacks[0] not in volumes:
        volumes = []
    if not volumes:
        raise _no_volume(folder, files, stacks, like)
    stack, contents = _chosen(folder, volumes, choice)
    left = len(stacks) - len(volumes)
    if left:
        notes += (f"Single images and those in colour were left out: {left} series.",)
    grid = read_stack(stack)
    return replace(
        grid,
        notes=choice_notes(contents) + notes + grid.notes,
        facts=replace(grid.facts, contents=contents),
    )


def _is_image_class(identifier: str) -> bool:
    """Whether objects of a class are images, by the standard's name of it."""
    from pydicom.uid import UID

    return "Image Storage" in UID(identifier).name


def _without_copies(images: list[DicomFile]) -> tuple[list[DicomFile], int]:
    """Leave out files that are copies of another, by their instance and place."""
    seen: set[tuple[str, str]] = set()
    kept = []
    for file in images:
        key = file.text("SOPInstanceUID"), file.text("ImagePositionPatient")
        if not key[0] or key not in seen:
            kept.append(file)
        seen.add(key)
    return kept, len(images) - len(kept)


def _is_grey(frame: Frame) -> bool:
    return (numbers_of(frame.file.tags, "SamplesPerPixel") or [1.0])[0] == 1


def _no_volume(
    folder: Path, files: Sequence[Path], stacks: list[Stack], like: Path | None
) -> VolumeError:
    first = stacks[0].frames[0]
    path = first.file.path if like is not None or len(files) == 1 else folder
    if not _is_grey(first) and len(stacks[0].frames) > 1:
        return unsupported(path, "a DICOM file in colour", "convert it to grey values")
    return VolumeError(
        f"{path}: this is a flat image of {first.columns} x {first.rows} x 1 pixels, not a volume; "
        "choose a series of at least two slices."
    )


def _chosen(
    folder: Path, volumes: list[Stack], choice: Choice
) -> tuple[Stack, tuple[Content, ...]]:
    """Return the chosen stack, and all others to choose from."""
    listed: tuple[Content, ...] = ()
    found = volumes
    for kind in ("series", "time", "channel"):
        names = list(dict.fromkeys(getattr(stack, kind) for stack in found))
        if kind != "series":
            names.sort(key=partial(_first_number, found, kind))
        number = chosen_index(folder, kind, names, getattr(choice, kind))
        if len(names) > 1:
            listed += tuple(
                _content(kind, name, [s for s in found if getattr(s, kind) == name], k == number)
                for k, name in enumerate(names)
            )
        found = [stack for stack in found if getattr(stack, kind) == names[number]]
    return found[0], listed


def _first_number(stacks: list[Stack], kind: str, name: str) -> float:
    return next(stack for stack in stacks if getattr(stack, kind) == name).frames[0].number


def _content(kind: str, name: str, stacks: list[Stack], is_read: bool) -> Content:
    stack = stacks[0]
    first = stack.frames[0]
    dimensions = first.columns, first.rows, len(stack.frames)
    dtype = value_type(stack.frames)
    size = int(np.prod(dimensions)) * dtype.itemsize
    return Content(kind, name, dimensions, dtype.name, size, is_read)  # type: ignore[arg-type]
