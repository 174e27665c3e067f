"""Opening of volumes, and of the open one over other ranges, in threads; the newest one wins."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any

from PySide6.QtCore import QObject, Signal

from app.engines.background import LatestCall
from app.engines.messages import error_sentence
from app.state.library import Library
from app.state.open_model import OpenModel
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.settings import VolumeMemory
from model.errors import TfscopeError, VolumeError
from model.scene.ranges import RangeChoice, fit_to_volume, robust_range
from model.scene.scene import Scene
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume
from model.volume_files.blocks import ReadingCancelledError, watched
from model.volume_files.choice import Choice
from model.volume_files.raw import RawLayout

PROGRESS_S = 0.2  # time between two reports of progress, in seconds


@dataclass(frozen=True)
class Wanted:
    """Options of how to read a volume, and how to show it first."""

    raw: RawLayout | None = None  # layout of a file without a header; None for the one in its name
    choice: Choice | None = None  # of several volumes in a file; None for the largest
    is_remembered: bool = False
    """Whether the choice is remembered, so that it is dropped if the file has changed."""
    scalar_range: RangeChoice | None = None  # None for the model's, the last, or a robust one
    scale: ValueScale | None = None
    model: Path | None = None
    """Folder of the model to open with it; None for the open model, or a known one of the volume.
    """
    memory: VolumeMemory | None = None
    """A session's memory, which replaces the volume's; None keeps that."""


class VolumeOpening(QObject):
    """Reads volumes, and prepares the open one over another range."""

    reading = Signal(str)  # emitted with the name of what is being read; empty when that has ended
    warned = Signal(str)  # emitted with a sentence about a volume that is shown nevertheless
    volumeRead = Signal(object)  # emitted with the :class:`OpenedVolume`, before it is shown
    opened = Signal(object)  # emitted with it, to be shown
    ranged = Signal(object)  # emitted with the open one over another range, or on another scale
    refused = Signal(str)  # emitted with a sentence on what went wrong
    said = Signal(str)  # emitted with what is being read, in words

    _progressed = Signal(object, str, int, int)

    def __init__(
        self,
        read_volume: Callable[..., Volume],
        model: OpenModel,
        library: Library,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._read_volume = read_volume
        self._model, self._library, self._preferences = model, library, preferences
        self._reading = LatestCall("volume", self, self._take, self._refuse, at_once=True)
        tell = self.ranged.emit, self.refused.emit
        self._ranging = LatestCall("range", self, *tell, at_once=True)
        self._stop = threading.Event()  # set when the volume being read is no longer wanted
        self._progressed.connect(self._say_progress)
        self._name = ""
        self.wanted = self.shown = Wanted()  # of the newest volume, and of the open one
        self._model_now = _ModelNow()

    @property
    def is_reading(self) -> bool:
        """True while a volume is read that is still wanted."""
        return self._reading.is_awaited

    @property
    def is_busy(self) -> bool:
        """True while something is read or computed that is still wanted."""
        return self.is_reading or self._ranging.is_awaited

    def open(self, path: Path, wanted: Wanted | None = None) -> None:
        """Read a volume in the background, and have it shown."""
        self._name, self.wanted = path.name, wanted or Wanted()
        self.said.emit(f"Reading {path.name} …")
        self.reading.emit(path.name)
        self._model_now = self._present_model()
        self._stop.set()
        self._stop = threading.Event()
        self._reading.ask(partial(self._read, path, self.wanted, self._stop))

    def cancel(self) -> None:
        """Cancel reading a volume; the open one stays."""
        if self.is_reading:
            self._stop.set()
            self._reading.forget()
            self._refuse(f"{self._name}: the reading was cancelled.")

    def follow_model(self) -> None:
        """Show the volume being read with the open model, which was chosen later."""
        self.wanted = replace(self.wanted, model=self._model.folder if self.is_reading else None)
        self._model_now = self._present_model()

    def model_for(self, fingerprint: str) -> Path | None:
        """Folder of the model to show with a volume."""
        memory = self._preferences.volume(fingerprint)
        return _model_for(fingerprint, memory, self._present_model(), self._library)

    def follow(self, transfer_function: TransferFunction) -> None:
        """Show the open volume over a TF's range and scale, if these have changed."""
        self._ranging.forget()
        self.show_over(transfer_function.scalar_range, transfer_function.scale)

    def show_over(self, scalar_range: Range, scale: ValueScale) -> None:
        """Show the open volume over another range and scale."""
        volume = self._model.volume
        if volume and (scalar_range, scale) != (volume.scalar_range, volume.scale):
            self._change(lambda: volume.over(scalar_range, scale))

    def show_on_scale(self, scale: ValueScale) -> None:
        """Show the open volume on another scale, under its default TF: one undo step."""
        volume = self._model.volume
        if volume and scale != volume.scale:
            self._change(lambda: _robust(volume.on_scale(scale)))

    def draw_missing(self, drawn: bool) -> None:
        """Draw the open volume's missing voxels, or leave them transparent (the default)."""
        volume = self._model.volume
        if volume and volume.missing is not None and drawn != volume.draws_missing:
            self._preferences.note_volume(volume.fingerprint, draws_missing=drawn)
            self._change(partial(volume.drawing_missing, drawn))

    def _change(self, changed: Callable[[], Volume]) -> None:
        """Show what a function makes of the open volume; it is called in a thread."""
        assert self._model.opened is not None
        path = self._model.opened.path
        self._ranging.ask(lambda: OpenedVolume.of(path, changed()))

    def abandon(self) -> None:
        """Discard all running work."""
        self._stop.set()
        self._reading.forget()
        self._ranging.forget()

    def join(self) -> None:
        """Wait until all threads have ended."""
        self._reading.join()
        self._ranging.join()

    def _present_model(self) -> _ModelNow:
        folder = self._model.folder
        scene = None if folder is None else self._model.scene or self._library.scene_of(folder)
        is_shown = self._model.volume_scene is not None
        return _ModelNow(self.wanted.model, folder, scene, is_shown)

    def _read(self, path: Path, wanted: Wanted, stop: threading.Event) -> _Read:
        """Read a volume, and compute what the window shows of it; in a thread of its own."""
        last = 0.0

        def listen(what: str, done: int, count: int) -> None:
            nonlocal last
            if stop.is_set():
                raise ReadingCancelledError("The reading was cancelled.")
            if monotonic() - last > PROGRESS_S:
                last = monotonic()
                self._progressed.emit(stop, what, done, count)

        with watched(listen):
            volume, gone = _read(self._read_volume, path, wanted)
        volume = _robust(volume)
        memory, damage = self._preferences.recall(volume.fingerprint)
        if wanted.memory is not None:
            memory = _replacing(memory, wanted.memory)
        problems, shown = [gone, damage], volume
        try:
            if memory.draws_missing and volume.missing is not None:
                shown = volume.drawing_missing(True)
        except TfscopeError as error:
            problems.append(error_sentence(error))
        mask = None
        try:
            mask = self._preferences.read_mask(memory.mask, volume)
        except TfscopeError as error:
            problems.append(f"All voxels are shown. {error_sentence(error)}")

        def first_shown() -> _Read:
            """Compute the volume's derived data over the wanted range."""
            model, said = self._model_now, [*problems]
            try:
                ranged = _first_range(shown, wanted, memory, model, self._library)
                opened = OpenedVolume.of(path, ranged, mask)
            except TfscopeError as error:
                said.append(error_sentence(error))
                opened = OpenedVolume.of(path, shown, mask)
            return _Read(opened, tuple(said), model, first_shown)

        return first_shown()

    def _say_progress(self, stop: threading.Event, what: str, done: int, count: int) -> None:
        if not stop.is_set():
            self.said.emit(f"Reading {self._name}: {done} of {count} {what} …")

    def _take(self, read: _Read) -> None:
        if read.model != self._model_now:
            # Another one was opened meanwhile, and may have another range.
            self._reading.ask(read.again)
            return
        self.reading.emit("")
        opened = read.opened
        self._ranging.forget()
        # Other windows may have changed its memory.
        damage = self._preferences.refresh(opened.fingerprint)
        self.volumeRead.emit(opened)
        for problem in filter(None, (*read.problems, damage)):
            self.warned.emit(problem)
        if self.wanted.memory is not None:
            known = self._preferences.volume(opened.fingerprint)
            kept = vars(_replacing(known, self.wanted.memory)) | {"path": known.path}
            self._preferences.note_volume(opened.fingerprint, **kept)
        self.shown = self.wanted
        self.opened.emit(opened)

    def _refuse(self, text: str) -> None:
        self.reading.emit("")
        self.refused.emit(text)


@dataclass(frozen=True)
class _ModelNow:
    """The wanted model of a volume, the open one, and whether that fits the volume."""

    wanted: Path | None = None
    folder: Path | None = None
    scene: Scene | None = None
    is_of_open_volume: bool = False


@dataclass(frozen=True, eq=False)
class _Read:
    """A volume as it is first shown next to a model, with warnings."""

    opened: OpenedVolume
    problems: tuple[str, ...]
    model: _ModelNow
    again: Callable[[], _Read]


def _read(read_volume: Callable[..., Volume], path: Path, wanted: Wanted) -> tuple[Volume, str]:
    """Read the chosen volume, or the largest with a warning if a remembered choice is gone."""
    options: dict[str, Any] = {} if wanted.raw is None else {"raw": wanted.raw}
    if wanted.choice is None:
        return read_volume(path, **options), ""
    try:
        return read_volume(path, **options, choice=wanted.choice), ""
    except ReadingCancelledError:
        raise
    except VolumeError as error:
        if not wanted.is_remembered:
            raise
        said = f"{error_sentence(error)} The file's largest volume is shown."
    return read_volume(path, **options), said


def _robust(volume: Volume) -> Volume:
    return volume.over(robust_range(volume))


def _first_range(
    volume: Volume, wanted: Wanted, memory: VolumeMemory, model: _ModelNow, library: Library
) -> Volume:
    """Return a volume over the wanted or remembered range and scale."""
    kept, fingerprint = memory.tf, volume.fingerprint
    if wanted.scale is not None and wanted.scale != volume.scale:
        volume = _robust(volume.on_scale(wanted.scale))
    if wanted.scalar_range is not None:
        return volume.over(wanted.scalar_range.of(volume))
    if wanted.scale is not None:
        return volume
    folder = _model_for(fingerprint, memory, model, library)
    scene = model.scene if folder == model.folder else None
    if scene is None and folder is not None:
        scene = library.scene_of(folder)
    belongs = scene is not None and scene.volume_fingerprint == fingerprint
    if scene is not None and belongs and (kept is None or kept.scale == scene.scale):
        return volume.over(scene.scalar_range, scene.scale)
    if kept is None:
        return volume
    fitted = fit_to_volume(kept, volume)
    return volume.over(fitted.scalar_range, fitted.scale)


def _model_for(
    fingerprint: str, memory: VolumeMemory, model: _ModelNow, library: Library
) -> Path | None:
    """Folder of the model to show with a volume: the wanted, the open or a known one.

    The open one is dropped if it belongs to the previous volume; one that waits for its volume
    stays.
    """
    if model.wanted is not None:
        return model.wanted
    if model.folder is not None:
        fits = model.scene is None or model.scene.volume_fingerprint == fingerprint
        if fits or not model.is_of_open_volume:
            return model.folder
    known = library.models_of(fingerprint, memory.models)
    return known[0].folder if known else None


def _replacing(kept: VolumeMemory, memory: VolumeMemory) -> VolumeMemory:
    """Return a session's memory, completed by machine facts and a TF if it has none."""
    of_machine = replace(memory, models=kept.models, light_seconds=kept.light_seconds)
    return replace(of_machine, tf=memory.tf or kept.tf)
