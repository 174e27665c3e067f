"""The way from a volume's file to what the window shows of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from app.engines.client import EngineClient
from app.state.generator_work import GeneratorWork
from app.state.library import Library
from app.state.opened_volume import OpenedVolume
from app.state.preferences import Preferences
from app.state.volume_opening import VolumeOpening
from model.errors import TfscopeError
from model.scene.range_choice import RangeChoice
from model.scene.range_fitting import fit_to_volume
from model.scene.robust_range import robust_range
from model.scene.transfer_function import Range, TransferFunction
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume
from model.volume_files.choice import Choice
from model.volume_files.raw import RawLayout


@dataclass(frozen=True)
class Wanted:
    """Wishes for how a volume is shown at first.

    Attributes
    ----------
    scalar_range : RangeChoice or None
        None for its model's, its last one, or a robust one.
    scale : {"linear", "log"} or None
        None for its model's or its last one.
    model : Path or None
        Folder of the model to open with it; None for the open one, or one known to be of it.
    transfer_function : TransferFunction or None
        None for its last one, or a default.
    """

    scalar_range: RangeChoice | None = None
    scale: ValueScale | None = None
    model: Path | None = None
    transfer_function: TransferFunction | None = None


class VolumeReading(QObject):
    """Reads volumes in the background, over the range and with the model that each is shown with.

    The open volume stays until the next one is there.

    Parameters
    ----------
    read_volume : callable
        Reads a volume of a path.
    reference : EngineClient
        Its pane tells what is read before there is any image.
    library : Library
        Models by their volumes.

    Attributes
    ----------
    wanted : Wanted
        What the volume that was asked for last is to be shown with.
    """

    started = Signal(str)
    """Emitted with the name of the file or folder that is about to be read."""
    ended = Signal()
    """Emitted when it was read, or was not."""
    volumeRead = Signal(object)
    """Emitted with the :class:`OpenedVolume` that was read: problems from now on are its own."""
    opened = Signal(object, object)
    """Emitted with the :class:`OpenedVolume` to be shown, and the TF kept of it, or None."""
    failed = Signal(str)
    """Emitted with an error sentence if it could not be read."""
    problem = Signal(str)
    """Emitted with an error sentence for what else went wrong."""
    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(
        self,
        read_volume: Callable[..., Volume],
        reference: EngineClient,
        model: GeneratorWork,
        library: Library,
        preferences: Preferences,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._reference, self._model = reference, model
        self._library, self._preferences = library, preferences
        self._opening = VolumeOpening(read_volume, self)
        self._opening.progressed.connect(self._tell_progress)
        self._shown: OpenedVolume | None = None
        self._name = ""
        self.wanted = Wanted()

    @property
    def is_busy(self) -> bool:
        """True while a volume is read that is still wanted."""
        return self._opening.is_busy

    def open(
        self,
        path: Path,
        raw: RawLayout | None = None,
        choice: Choice | None = None,
        is_remembered: bool = False,
        wanted: Wanted | None = None,
    ) -> None:
        """Read a volume in the background.

        Parameters
        ----------
        raw : RawLayout or None
            Of a file without a header; None for the one in its name.
        choice : Choice or None
            What to read of a file that holds several volumes; None for the largest.
        is_remembered : bool
            Whether the choice is an old one, which gives way where the file no longer has it.
        wanted : Wanted, optional
            What to show it with.
        """
        self._name, self.wanted = path.name, wanted or Wanted()
        text = f"Reading {path.name} …"
        if self._shown is None:
            self._reference.wait(text)
        else:
            self.news.emit(text)
        self.started.emit(path.name)
        self._opening.read(path, raw, self._read, self._fail, choice, is_remembered)

    def cancel(self) -> None:
        """Give up reading a volume; the open one stays."""
        if self.is_busy:
            self._opening.abandon()
            self._fail(f"{self._name}: the reading was cancelled.")

    def forget_model(self) -> None:
        """Open no model with the volume that is read: another one was asked for since."""
        self.wanted = replace(self.wanted, model=None)

    def kept_tf(self, fingerprint: str) -> TransferFunction | None:
        """Return the TF under which a volume was seen last; None if that is not known."""
        return self._preferences.volume(fingerprint).tf

    def model_for(self, opened: OpenedVolume) -> Path | None:
        """Model to show with a volume: the open one, or one that is known to be of it.

        One that was asked for with it comes first. A model gives way if it was of the volume
        before; one that waits for its own stays.
        """
        if self.wanted.model is not None:
            return self.wanted.model
        model = self._model.folder
        if model is not None:
            scene = self._model.scene or self._library.scene_of(model)
            fits = scene is None or scene.volume_fingerprint == opened.fingerprint
            if fits or self._model.scene_for(self._shown) is None:
                return model
        known = self._library.models_of(opened.fingerprint)
        return known[0].folder if known else None

    def abandon(self) -> None:
        """Discard what is on its way."""
        self._opening.abandon()

    def join(self) -> None:
        """Wait until all threads have ended."""
        self._opening.join()

    def _fail(self, text: str) -> None:
        self.ended.emit()
        self.failed.emit(text)

    def _tell_progress(self, what: str, done: int, count: int) -> None:
        if not self.is_busy:
            # Told before it was cancelled.
            return
        text = f"Reading {self._name}: {done} of {count} {what} …"
        self.news.emit(text)
        if self._shown is None:
            self._reference.wait(text)

    def _read(self, opened: OpenedVolume) -> None:
        """Show a volume that was read, with its missing voxels if they were drawn the last time."""
        self.ended.emit()
        # What other windows have kept of it meanwhile.
        problem = self._preferences.refresh(opened.fingerprint)
        self.volumeRead.emit(opened)
        if problem:
            self.problem.emit(problem)
        known = self._preferences.volume(opened.fingerprint)
        if known.draws_missing and opened.has_missing:
            show, failed = self._show_over_wanted, partial(self._show_nevertheless, opened)
            self._opening.draw_missing(opened, True, show, failed)
        else:
            self._show_over_wanted(opened)

    def _show_nevertheless(self, opened: OpenedVolume, text: str) -> None:
        self._show_over_wanted(opened)
        self.problem.emit(text)

    def _show_over_wanted(self, opened: OpenedVolume) -> None:
        """Show a volume; first compute it over another range if one is wanted."""
        kept = self.wanted.transfer_function or self.kept_tf(opened.fingerprint)
        show = partial(self._show, kept)
        try:
            wanted, scale = self._wanted_range(opened, kept)
        except TfscopeError as error:
            self.problem.emit(str(error))
            wanted, scale = opened.volume.scalar_range, opened.volume.scale
        if (wanted, scale) == (opened.volume.scalar_range, opened.volume.scale):
            show(opened)
            return

        def show_as_read(text: str) -> None:
            show(opened)
            self.problem.emit(text)

        self._opening.show_over(opened, wanted, scale, show, show_as_read)

    def _show(self, kept: TransferFunction | None, opened: OpenedVolume) -> None:
        self.opened.emit(opened, kept)
        self._shown = opened

    def _wanted_range(
        self, opened: OpenedVolume, kept: TransferFunction | None
    ) -> tuple[Range, ValueScale]:
        """Range to show a volume over at first, and on which scale.

        The scale of the TF that is kept of it comes before that of a model.
        """
        volume, asked = opened.volume, self.wanted
        if asked.scale is not None and asked.scale != volume.scale:
            volume = volume.on_scale(asked.scale)
            volume = volume.over(robust_range(volume))
        if asked.scalar_range is not None:
            return asked.scalar_range.of(volume), volume.scale
        if asked.scale is not None:
            return volume.scalar_range, volume.scale
        folder = self.model_for(opened)
        scene = self._model.scene if folder == self._model.folder else None
        if scene is None and folder is not None:
            scene = self._library.scene_of(folder)
        belongs = scene is not None and scene.volume_fingerprint == opened.fingerprint
        if scene is not None and belongs and (kept is None or kept.scale == scene.scale):
            return scene.scalar_range, scene.scale
        if kept is None:
            return volume.scalar_range, volume.scale
        fitted = fit_to_volume(kept, volume)
        return fitted.scalar_range, fitted.scale
