"""Opening of volumes, and of the open one over other ranges, in threads; the newest wish counts."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import monotonic
from typing import Any, Protocol

from PySide6.QtCore import QObject, Signal

from app.engines.background import BackgroundCall
from app.engines.messages import error_sentence
from app.state.generator_work import GeneratorWork
from app.state.library import Library
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.volume_memory import VolumeMemory
from model.errors import TfscopeError, VolumeError
from model.scene.ranges import RangeChoice, fit_to_volume, robust_range
from model.scene.scene import Scene
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume
from model.volume_files.choice import Choice
from model.volume_files.progress import Listener, ReadingCancelledError, watched
from model.volume_files.raw import RawLayout

PROGRESS_S = 0.2
"""Time between two reports of progress, in seconds."""


@dataclass(frozen=True)
class Wanted:
    """Choices of how to read a volume, and how to show it at first.

    Attributes
    ----------
    raw : RawLayout or None
        Layout of a file without a header; None for the one in its name.
    choice : Choice or None
        What to read of a file that holds several volumes; None for the largest.
    is_remembered : bool
        Whether the choice is an old one, which gives way where the file no longer has it.
    scalar_range : RangeChoice or None
        None for its model's, its last one, or a robust one.
    scale : {"linear", "log"} or None
        None for its model's or its last one.
    model : Path or None
        Folder of the model to open with it; None for the open one, or one known to be of it.
    memory : VolumeMemory or None
        A session's; None for what is kept of the volume.
    """

    raw: RawLayout | None = None
    choice: Choice | None = None
    is_remembered: bool = False
    scalar_range: RangeChoice | None = None
    scale: ValueScale | None = None
    model: Path | None = None
    memory: VolumeMemory | None = None


class Viewer(Protocol):
    """Shows what was opened: the workspace."""

    @property
    def opened(self) -> OpenedVolume | None:
        """The open volume; None if there is none."""

    def show(self, opened: OpenedVolume) -> None:
        """Show a volume that was read."""

    def show_range(self, opened: OpenedVolume) -> None:
        """Show the open volume over another range, or on another scale."""

    def refuse(self, text: str) -> None:
        """Say why nothing else is shown."""

    def warn(self, text: str) -> None:
        """Say what else went wrong."""

    def say_progress(self, text: str) -> None:
        """Say what is being read."""


class VolumeOpening(QObject):
    """Reads volumes, and computes what the open one is over another range.

    The open volume stays until the next one is there. `wanted` says how the volume that was asked
    for last is to be shown.
    """

    reading = Signal(str)
    """Emitted with the name of what is being read; empty when that has ended."""
    volumeRead = Signal(object)
    """Emitted with the :class:`OpenedVolume`, before it is shown."""

    _progressed = Signal(object, str, int, int)

    def __init__(
        self,
        read_volume: Callable[..., Volume],
        viewer: Viewer,
        model: GeneratorWork,
        library: Library,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._read_volume, self._viewer = read_volume, viewer
        self._model, self._library, self._preferences = model, library, preferences
        self._reading, self._ranging = _Newest(self), _Newest(self)
        self._progressed.connect(self._say_progress)
        self._name = ""
        self.wanted = Wanted()
        self._model_now = _ModelNow()

    @property
    def is_reading(self) -> bool:
        """True while a volume is read that is still wanted."""
        return self._reading.is_busy

    @property
    def is_busy(self) -> bool:
        """True while something is read or computed that is still wanted."""
        return self.is_reading or self._ranging.is_busy

    def open(self, path: Path, wanted: Wanted | None = None) -> None:
        """Read a volume in the background, and have it shown."""
        self._name, self.wanted = path.name, wanted or Wanted()
        self._viewer.say_progress(f"Reading {path.name} …")
        self.reading.emit(path.name)
        self._model_now = self._present_model()
        task = _Task(
            path, self.wanted, self._read_volume, self._preferences.recall,
            lambda: self._model_now, self._library,
        )  # fmt: skip
        self._reading.run(partial(self._run, task), self._take, self._refuse)

    def cancel(self) -> None:
        """Give up reading a volume; the open one stays."""
        if self.is_reading:
            self._reading.abandon()
            self._refuse(f"{self._name}: the reading was cancelled.")

    def follow_model(self) -> None:
        """Show the volume that is read with the model that is open: it was asked for since."""
        self.wanted = replace(self.wanted, model=None)
        self._model_now = self._present_model()

    def model_for(self, fingerprint: str) -> Path | None:
        """Folder of the model to show with a volume."""
        memory = self._preferences.volume(fingerprint)
        return _model_for(fingerprint, memory, self._present_model(), self._library)

    def follow(self, transfer_function: TransferFunction) -> None:
        """Show the open volume over a TF's range and scale, where these were changed."""
        self._ranging.abandon()
        self.show_over(transfer_function.scalar_range, transfer_function.scale)

    def show_over(self, scalar_range: Range, scale: ValueScale) -> None:
        """Show the open volume over another range and scale."""
        opened = self._viewer.opened
        if opened is None:
            return
        if (scalar_range, scale) != (opened.volume.scalar_range, opened.volume.scale):
            self._range(partial(opened.over, scalar_range, scale))

    def show_on_scale(self, scale: ValueScale) -> None:
        """Show the open volume on another scale, under its default TF: one undo step."""
        opened = self._viewer.opened
        if opened is not None and scale != opened.volume.scale:
            self._range(partial(opened.on_scale, scale))

    def draw_missing(self, drawn: bool) -> None:
        """Draw the open volume's missing voxels, or leave them transparent, as at first."""
        opened = self._viewer.opened
        if opened is not None and opened.has_missing and drawn != opened.volume.draws_missing:
            self._preferences.note_volume(opened.fingerprint, draws_missing=drawn)
            self._range(partial(opened.drawing_missing, drawn))

    def abandon(self) -> None:
        """Discard what is on its way."""
        self._reading.abandon()
        self._ranging.abandon()

    def join(self) -> None:
        """Wait until all threads have ended."""
        self._reading.join()
        self._ranging.join()

    def _range(self, compute: Callable[[], OpenedVolume]) -> None:
        self._ranging.run(lambda _stop: compute(), self._viewer.show_range, self._viewer.refuse)

    def _present_model(self) -> _ModelNow:
        folder = self._model.folder
        scene = None if folder is None else self._model.scene or self._library.scene_of(folder)
        is_shown = self._model.scene_for(self._viewer.opened) is not None
        return _ModelNow(self.wanted.model, folder, scene, is_shown)

    def _run(self, task: _Task, stop: threading.Event) -> _Read:
        """Do a task in its thread, and report its progress at times."""
        last = 0.0

        def listen(what: str, done: int, count: int) -> None:
            nonlocal last
            if stop.is_set():
                raise ReadingCancelledError("The reading was cancelled.")
            if monotonic() - last > PROGRESS_S:
                last = monotonic()
                self._progressed.emit(stop, what, done, count)

        return task.run(listen)

    def _say_progress(self, stop: threading.Event, what: str, done: int, count: int) -> None:
        if not stop.is_set():
            self._viewer.say_progress(f"Reading {self._name}: {done} of {count} {what} …")

    def _take(self, read: _Read) -> None:
        if read.model != self._model_now:
            # Another one was opened meanwhile, and may have another range.
            self._reading.run(lambda _stop: read.again(), self._take, self._refuse)
            return
        self.reading.emit("")
        opened = read.opened
        self._ranging.abandon()
        # What other windows have kept of it since.
        damage = self._preferences.refresh(opened.fingerprint)
        self.volumeRead.emit(opened)
        for problem in filter(None, (*read.problems, damage)):
            self._viewer.warn(problem)
        self._viewer.show(opened)

    def _refuse(self, text: str) -> None:
        self.reading.emit("")
        self._viewer.refuse(text)


@dataclass(frozen=True)
class _ModelNow:
    """The model that is wanted with a volume, the open one, and whether it is of the open volume.

    Another model may be opened while the volume is read.
    """

    wanted: Path | None = None
    folder: Path | None = None
    scene: Scene | None = None
    is_of_open_volume: bool = False


@dataclass(frozen=True, eq=False)
class _Read:
    """A volume as it is shown first next to a model, and what went wrong on the way.

    Where the model is another one by now, the volume is computed again for that.
    """

    opened: OpenedVolume
    problems: tuple[str, ...]
    model: _ModelNow
    again: Callable[[], _Read]


@dataclass(frozen=True, eq=False)
class _Task:
    """Everything from a path to a volume over the range that it is shown over at first."""

    path: Path
    wanted: Wanted
    read_volume: Callable[..., Volume]
    recall: Callable[[str], tuple[VolumeMemory, str]]
    model: Callable[[], _ModelNow]
    library: Library

    def run(self, listener: Listener) -> _Read:
        """Read the volume, and compute what the window shows of it.

        Raises
        ------
        VolumeError
            When the file holds no usable volume.
        """
        with watched(listener):
            volume, gone = self._read()
        volume = volume.over(robust_range(volume))
        memory, damage = self.recall(volume.fingerprint)
        if self.wanted.memory is not None:
            tf = self.wanted.memory.tf or memory.tf
            memory = replace(self.wanted.memory, tf=tf, models=memory.models)
        problems, shown = [gone, damage], volume
        try:
            if memory.draws_missing and volume.missing is not None:
                shown = volume.drawing_missing(True)
        except TfscopeError as error:
            problems.append(error_sentence(error))
        return self._opened(shown, memory, tuple(problems))

    def _opened(self, volume: Volume, memory: VolumeMemory, problems: tuple[str, ...]) -> _Read:
        """Compute what the window shows of a volume over the range that is wanted."""
        model, again = self.model(), partial(self._opened, volume, memory, problems)
        try:
            opened = OpenedVolume.of(self.path, self._over(volume, memory, model))
            return _Read(opened, problems, model, again)
        except TfscopeError as error:
            problems = (*problems, error_sentence(error))
        return _Read(OpenedVolume.of(self.path, volume), problems, model, again)

    def _read(self) -> tuple[Volume, str]:
        """Read what was chosen, or the largest volume if an old choice is gone, which is said."""
        wanted = self.wanted
        options: dict[str, Any] = {} if wanted.raw is None else {"raw": wanted.raw}
        if wanted.choice is None:
            return self.read_volume(self.path, **options), ""
        try:
            return self.read_volume(self.path, **options, choice=wanted.choice), ""
        except ReadingCancelledError:
            raise
        except VolumeError as error:
            if not wanted.is_remembered:
                raise
            said = f"{error_sentence(error)} The file's largest volume is shown."
        return self.read_volume(self.path, **options), said

    def _over(self, volume: Volume, memory: VolumeMemory, model: _ModelNow) -> Volume:
        """Return the volume over the range and on the scale that are wanted, or remembered.

        The scale of the TF that is kept of it comes before that of a model.
        """
        wanted, kept = self.wanted, memory.tf
        if wanted.scale is not None and wanted.scale != volume.scale:
            volume = volume.on_scale(wanted.scale)
            volume = volume.over(robust_range(volume))
        if wanted.scalar_range is not None:
            return volume.over(wanted.scalar_range.of(volume))
        if wanted.scale is not None:
            return volume
        fingerprint = volume.fingerprint
        folder = _model_for(fingerprint, memory, model, self.library)
        scene = model.scene if folder == model.folder else None
        if scene is None and folder is not None:
            scene = self.library.scene_of(folder)
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
    """Folder of the model to show with a volume: the open one, or one that is known to be of it.

    One that was asked for with it comes first. A model gives way if it was of the volume before;
    one that waits for its own stays.
    """
    if model.wanted is not None:
        return model.wanted
    if model.folder is not None:
        fits = model.scene is None or model.scene.volume_fingerprint == fingerprint
        if fits or not model.is_of_open_volume:
            return model.folder
    known = library.models_of(fingerprint, memory.models)
    return known[0].folder if known else None


class _Newest(QObject):
    """Runs each function in a thread of its own; only the newest one's result is taken.

    A function is given an event that is set once its result is no longer wanted.
    """

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._calls: list[BackgroundCall] = []
        self._newest: BackgroundCall | None = None
        self._stop = threading.Event()

    @property
    def is_busy(self) -> bool:
        """True while a result is expected."""
        return self._newest is not None

    def run(
        self,
        function: Callable[[threading.Event], Any],
        take: Callable[[Any], object],
        refuse: Callable[[str], object],
    ) -> None:
        """Have a function's result taken, or the sentence of its error."""
        self.abandon()
        self._stop = threading.Event()
        call = BackgroundCall(partial(function, self._stop), "volume")
        call.done.connect(partial(self._finish, take))
        call.failed.connect(partial(self._finish, refuse))
        call.finished.connect(self._forget_call)
        self._newest = call
        self._calls.append(call)
        call.start()

    def abandon(self) -> None:
        """Discard what is on its way."""
        self._stop.set()
        if self._newest is not None:
            self._newest.abandon()
            self._newest = None

    def join(self) -> None:
        """Wait until all threads have ended."""
        for call in self._calls:
            call.join()
            call.deleteLater()
        self._calls.clear()

    def _finish(self, take: Callable[[Any], object], outcome: object) -> None:
        # Whoever takes it may start the next one.
        self._newest = None
        take(outcome)

    def _forget_call(self) -> None:
        call = self.sender()
        if isinstance(call, BackgroundCall) and call in self._calls:
            self._calls.remove(call)
            call.join()
            call.deleteLater()
