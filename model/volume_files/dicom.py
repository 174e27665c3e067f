"""DICOM series, given as a folder or one of its files, and their stacks."""

import itertools
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from model.errors import VolumeError
from model.scene.volume import Content
from model.volume_files.blocks import counted
from model.volume_files.checks import log_of, not_a, slices_in, truncated, unsupported
from model.volume_files.choice import LARGEST, MOST_LISTED, AskedKind, Choice, chosen_index, content
from model.volume_files.dicom_tags import (
    DicomFile,
    Frame,
    frames_of,
    is_dicom,
    is_foreign,
    number_in,
    read_dicom_file,
)
from model.volume_files.dicom_volume import heights, read_stack, value_type
from model.volume_files.grid import Grid

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
LATE_FIELDS = ("AcquisitionTime", "ContentTime")  # times of the clock, tried last

WORDS = {
    "EchoNumbers": "echo", "EchoTime": "echo time",
    "EffectiveEchoTime": "echo time", "DiffusionBValue": "b",
    "DiffusionGradientOrientation": "gradient", "ReferencedSegmentNumber": "segment",
    "StackID": "stack",
}  # fmt: skip

SAME_PLACE = 1e-3  # distance in mm below which two images are at the same position


@dataclass(frozen=True, eq=False)
class Stack:
    """Images that may form a volume."""

    frames: tuple[Frame, ...]
    series: str
    time: str = ""
    channel: str = ""


def stacks_of(frames: Sequence[Frame]) -> list[Stack]:
    """Find the volumes among images, the largest first.

    Images of another series, size, type, spacing or orientation are of another stack. Images at the
    same position are divided by fields for acquisitions, time steps and the like.
    """
    groups: dict[tuple[object, ...], list[Frame]] = defaultdict(list)
    for frame in frames:
        groups[_kind(frame)].append(frame)
    stacks = []
    for members in groups.values():
        file = members[0].file
        words = filter(None, (file.text("SeriesNumber"), file.text("SeriesDescription")))
        for stack in _divided(Stack(tuple(members), " ".join(words)[:80] or "series")):
            stacks += _apart(stack)
    stacks.sort(key=lambda stack: -len(stack.frames))
    return _named_apart(stacks)


def _kind(frame: Frame) -> tuple[object, ...]:
    """Properties that the images of a volume share."""
    tags = frame.file
    return (
        tags.text("SeriesInstanceUID"),
        frame.rows,
        frame.columns,
        tags.kind,
        tags.text("BitsAllocated"),
        tags.text("PixelRepresentation"),
        tags.text("SamplesPerPixel"),
        "LOCALIZER" in tags.text("ImageType").upper(),
        tuple(round(number, 2) for number in frame.orientation),
        tuple(round(number, 4) for number in frame.spacing),
    )


def _named_apart(stacks: list[Stack]) -> list[Stack]:
    """Give different names to series of the same name, except times and channels of one.

    To a name is added what tells them apart: the folder, the spacing, or else a number.
    """
    firsts: dict[str, dict[tuple[object, ...], Frame]] = defaultdict(dict)
    # Once for each, as NaN of a damaged file equals itself alone.
    kinds = [_kind(stack.frames[0]) for stack in stacks]
    for stack, kind in zip(stacks, kinds, strict=True):
        firsts[stack.series].setdefault(kind, stack.frames[0])
    names = {}
    for series, alike in firsts.items():
        folders = [frame.file.path.parent.name for frame in alike.values()]
        # A damaged file may have any number of them.
        sides = [[f"{side:g}" for side in reversed(frame.spacing)] for frame in alike.values()]
        spacings = [f"{' x '.join(each)} mm" for each in sides]
        numbers = ["", *map(str, range(2, len(alike) + 1))]
        apart = next(each for each in (folders, spacings, numbers) if len({*each}) == len(alike))
        for kind, text in zip(alike, apart, strict=True):
            is_plain = len(alike) == 1 or not text
            names[series, kind] = series if is_plain else f"{series} ({text})"
    return [
        replace(stack, series=names[stack.series, kind])
        for stack, kind in zip(stacks, kinds, strict=True)
    ]


def _is_placed(frames: Iterable[Frame]) -> bool:
    return all(frame.position for frame in frames)


def _place(frame: Frame) -> tuple[float, ...]:
    """Return an image's position, rounded so that images at the same position agree."""
    return tuple(np.round(np.array(frame.position) / SAME_PLACE / 10))


def _repeats(frames: Sequence[Frame]) -> int:
    """Number of images at the position of another one."""
    return len(frames) - len({_place(frame) for frame in frames}) if _is_placed(frames) else 0


def _divided(stack: Stack) -> list[Stack]:
    """Divide a stack while images share a position and a field distinguishes them."""
    frames = stack.frames
    if len(frames) < 2 or not _is_placed(frames):
        return [stack]
    parts = _by_field(frames, "AcquisitionNumber")
    if len(parts) > 1 and all(len(part) > 1 for part in parts.values()) and _overlap(parts):
        return _labelled(stack, parts, "series", "acquisition")
    repeats = _repeats(frames)
    if not repeats:
        return [stack]
    labelled = (TIME_FIELDS, "time"), (CHANNEL_FIELDS, "channel"), (LATE_FIELDS, "time")
    for fields, label in labelled:
        for name in fields:
            parts = _by_field(frames, name)
            if len(parts) > 1 and sum(_repeats(part) for part in parts.values()) < repeats:
                return _labelled(stack, parts, label, WORDS.get(name, ""))
    if parts := _by_rank(frames):
        return _labelled(stack, parts, "time", "")
    return [stack]


def _labelled(stack: Stack, parts: dict[str, list[Frame]], label: str, word: str) -> list[Stack]:
    found = []
    for value, part in parts.items():
        before = getattr(stack, label)
        text = ", ".join(each for each in (before, f"{word} {value}".strip()) if each)
        found += _divided(replace(stack, frames=tuple(part), **{label: text}))
    return found


def _by_field(frames: Sequence[Frame], name: str) -> dict[str, list[Frame]]:
    """Group images by a field, in the order of its values."""
    parts: dict[str, list[Frame]] = defaultdict(list)
    for frame in frames:
        parts[frame.field(name)].append(frame)
    return dict(sorted(parts.items(), key=lambda item: _order(item[0])))


def _order(text: str) -> tuple[int, float, str]:
    try:
        return 0, float(text), ""
    except ValueError:
        return 1, 0.0, text


def _by_rank(frames: Sequence[Frame]) -> dict[str, list[Frame]]:
    """Group images by how many with lower numbers are at the same position, if all agree."""
    at: dict[tuple[float, ...], list[Frame]] = defaultdict(list)
    for frame in sorted(frames, key=lambda frame: frame.number):
        at[_place(frame)].append(frame)
    if len({len(members) for members in at.values()}) != 1 or len(at) < 2:
        return {}
    return {str(rank): list(part) for rank, part in enumerate(zip(*at.values(), strict=True))}


def _overlap(parts: dict[str, list[Frame]]) -> bool:
    """Whether the groups' intervals along the normal overlap."""
    normal = next(iter(parts.values()))[0].normal
    places = [[float(np.dot(frame.position, normal)) for frame in part] for part in parts.values()]
    ends = sorted((min(each), max(each)) for each in places)
    return any(b[0] < a[1] - SAME_PLACE for a, b in itertools.pairwise(ends))


def _apart(stack: Stack) -> list[Stack]:
    """Divide images of two or more stacks side by side."""
    frames = stack.frames
    if len(frames) < 4 or not _is_placed(frames):
        return [stack]
    parts = _by_side(frames)
    if not parts:
        ordered = [frames[k] for k in np.argsort(heights(frames), kind="stable")]
        places = np.array([frame.position for frame in ordered])
        jumps = np.linalg.norm(np.diff(places, axis=0), axis=1)
        usual = float(np.median(jumps))
        if usual <= 0 or (jumps <= 20 * usual).all():
            return [stack]
        # Only if the pieces are volumes by themselves; else it is a gap, which is reported.
        cuts = [0, *(np.flatnonzero(jumps > 20 * usual) + 1).tolist(), len(ordered)]
        parts = [ordered[a:b] for a, b in itertools.pairwise(cuts)]
        if min(len(part) for part in parts) < 2:
            return [stack]
    return [
        replace(stack, frames=tuple(part), series=f"{stack.series}, part {number}")
        for number, part in enumerate(parts, 1)
    ]


def _by_side(frames: Sequence[Frame]) -> list[list[Frame]]:
    """Group images that lie at equal heights, but side by side."""
    along = heights(frames)
    if len(np.unique(np.round(along / SAME_PLACE / 10))) == len(frames):
        return []
    normal = np.array(frames[0].normal)
    sides: dict[tuple[float, ...], list[Frame]] = defaultdict(list)
    for frame, height in zip(frames, along, strict=True):
        side = np.round(np.array(frame.position) - height * normal, 1) + 0.0
        sides[tuple(side.tolist())].append(frame)
    parts = list(sides.values())
    return parts if len(parts) > 1 and min(len(part) for part in parts) > 1 else []


SUFFIXES = (".dcm", ".dicom", ".ima")


def dicom_slices(folder: Path, below: bool = False) -> list[Path]:
    """Return the files of a folder that have a DICOM suffix or DICOM content, sorted by name.

    A disc's folder, which has a DICOMDIR, has its images in folders `below` it.
    """
    folders = [folder]
    if below or any(path.name.upper() == "DICOMDIR" for path in folder.iterdir()):
        folders += [path for path in folder.rglob("*") if path.is_dir() and not path.is_symlink()]
    files = sorted(path for each in folders for path in slices_in(each, SUFFIXES))
    return [
        path
        for path in files
        if path.name.upper() != "DICOMDIR" and (path.suffix.lower() in SUFFIXES or is_dicom(path))
    ]


def list_dicom(files: Sequence[Path]) -> tuple[list[Stack], tuple[str, ...]]:
    """Find the volumes in DICOM files by their tags, the largest first; also return notes."""
    from pydicom.uid import UID

    foreign = {path for path in files if is_foreign(path)}
    known = [path for path in files if path not in foreign] or files
    read = [read_dicom_file(path) for path in counted("files listed", known)]
    images = [file for file in read if file.kind is not None]
    others = [file for file in read if file.kind is None]
    classes = {file.text("SOPClassUID") for file in images}
    for file in others:
        # A truncated file may have only the beginning of its class.
        begun = (file.text("SOPClassUID"), file.meta_text("MediaStorageSOPClassUID"))
        is_image = any(each.startswith(part) for each in classes for part in begun)
        is_image |= not classes and any("Image Storage" in UID(part).name for part in begun)
        if "Rows" in file.tags or is_image:
            raise truncated(file.path, "it has no pixels")
    notes: tuple[str, ...] = ()
    if len(known) < len(files):
        left = [path.name for path in files if path in foreign][:MOST_LISTED]
        notes = (f"Files that are not DICOM were left out: {', '.join(left)}.",)
    if others:
        notes += (f"DICOM files without an image were left out: {len(others)}.",)
    if not images:
        raise VolumeError(
            f"{files[0].parent}: no DICOM file here holds an image; choose another folder."
        )
    unique: dict[tuple[str, ...], DicomFile] = {}
    for file in images:
        key = file.text("SOPInstanceUID"), file.text("ImagePositionPatient")
        unique.setdefault(key if key[0] else (str(file.path),), file)
    if copies := len(images) - len(unique):
        notes += (f"Files with the same image as another were left out: {copies}.",)
    return stacks_of([frame for file in unique.values() for frame in frames_of(file)]), notes


def read_dicom(files: Sequence[Path], like: Path | None = None, choice: Choice = LARGEST) -> Grid:
    """Read one volume from a folder's files: that of the file `like`, or the largest."""
    with log_of("pydicom"):
        return _read(files, like, choice)


def _read(files: Sequence[Path], like: Path | None, choice: Choice) -> Grid:
    folder = files[0].parent
    if like is not None and not is_dicom(like):
        raise not_a(like, "a DICOM file")
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
    grid = read_stack(stack.frames)
    facts = replace(grid.facts, contents=contents)
    return replace(grid, notes=notes + grid.notes, facts=facts)


def _is_grey(frame: Frame) -> bool:
    return number_in(frame.file.tags, "SamplesPerPixel", 1.0) == 1


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
    kinds: tuple[AskedKind, ...] = ("series", "time", "channel")
    for kind in kinds:
        by_name: dict[str, list[Stack]] = defaultdict(list)
        for stack in found:
            by_name[getattr(stack, kind)].append(stack)
        names = [*by_name]
        if kind != "series":
            names.sort(key=lambda name: by_name[name][0].frames[0].number)
        number = chosen_index(folder, kind, names, getattr(choice, kind))
        for k, name in enumerate(names if names[1:] else []):
            frames = by_name[name][0].frames
            sizes = frames[0].columns, frames[0].rows, len(frames)
            listed += (content(kind, name, sizes, value_type(frames), k == number),)
        found = by_name[names[number]]
    return found[0], listed
