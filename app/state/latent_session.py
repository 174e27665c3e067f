"""The latent space of the open volume, its map, and the user's choices."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Qt, Signal

from app.engines.background import LatestCall
from app.state.viewer_state import ViewerState
from model.errors import LatentError
from model.latent.differing import chosen_by, most_different
from model.latent.embedding import EmbeddingProcess, Places
from model.latent.latent_map import Brush, LatentMap
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF, Range
from model.scene.value_scale import ValueScale
from model.scene.volume import Volume

if TYPE_CHECKING:
    from model.latent.latent_space import LatentSpace
    from model.latent.tiny_pictures import Overview


CodecChoice = Literal["shipped", "model"]
Place = tuple[float, float]

FIRST_BRUSH: Brush = (-0.8, -0.8, 0.8, 0.8)  # most of the map, as in the paper


@dataclass(frozen=True)
class LatentChoices:
    """Choices in the latent browser."""

    shown: bool = False  # whether the browser is open
    on_map: bool = False  # whether map and grid are shown, not the most different pictures
    codec: CodecChoice = "shipped"  # whose codes these are
    band: Range | None = None  # TFs that show none of these scalar values are dim


class LatentState(QObject):
    """Brush, place under the mouse, and choices."""

    choicesChanged = Signal(object)
    brushChanged = Signal(object)  # emitted with the rectangle of a drag, and at its end
    hoverChanged = Signal(object)  # emitted with the place under the mouse on the map, or None

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.choices = LatentChoices()
        self.brush: Brush = FIRST_BRUSH
        self.dragging = False
        self.hover: Place | None = None
        self.closeness = 1.0

    def choose(self, **changes: Any) -> None:
        """Change some of the :class:`LatentChoices`."""
        choices = replace(self.choices, **changes)
        if choices != self.choices:
            self.choices = choices
            self.choicesChanged.emit(choices)

    def move_brush(self, brush: Brush) -> None:
        """Change the rectangle during a drag."""
        if brush != self.brush:
            self.brush, self.dragging = brush, True
            self.brushChanged.emit(brush)

    def finish_brush(self) -> None:
        """End a drag of the rectangle."""
        if self.dragging:
            self.dragging = False
            self.brushChanged.emit(self.brush)

    def set_brush(self, brush: Brush) -> None:
        """Change the rectangle without a drag."""
        self.move_brush(brush)
        self.finish_brush()

    def set_hover(self, place: Place | None, closeness: float = 1.0) -> None:
        """Set the place under the mouse, or None, and the zoom of the map."""
        if (place, closeness) != (self.hover, self.closeness):
            self.hover, self.closeness = place, closeness
            self.hoverChanged.emit(place)

    def start_choices(self) -> None:
        """Forget what was chosen on the map."""
        self.set_hover(None)
        self.set_brush(FIRST_BRUSH)


OpenSpace = Callable[[Range, Range, ValueScale, Path | None], "LatentSpace"]
"""Opens the space for a scalar range, a window of it and their scale, or a model folder's."""


class LatentSession(QObject):
    """Opens a codec and its map in the background when the browser is first shown.

    Without a stored map it shows principal components until a process has computed t-SNE.
    """

    mapChanged = Signal(object)
    """Emitted with the map: another codec's or volume's, or the same at its final places. None
    until the next one is opened."""
    progressed = Signal(float)  # emitted with the progress of t-SNE; 1 at its end
    looked = Signal(float)  # emitted in other threads with the progress of an overview
    overviewChanged = Signal(object)
    differentChanged = Signal()
    filterChanged = Signal()  # emitted when other samples pass the filters
    marksChanged = Signal()  # emitted when the present or the different TFs have other places
    problem = Signal(str)  # emitted with a sentence for the user; empty when it no longer holds

    _advanced = Signal(object, float)

    def __init__(
        self, state: ViewerState, latent: LatentState, open_space: OpenSpace, parent: QObject
    ) -> None:
        super().__init__(parent)
        self.space: LatentSpace | None = None
        self.map: LatentMap | None = None
        # Whether each sample (n,) passes the filters, and the map with those that do.
        self.wanted: NDArray[np.bool_] | None = None
        self.chosen: LatentMap | None = None
        # Of the map's TFs, in the view, crop box and colours of `overview_of`.
        self.overview: Overview | None = None
        self.overview_of: object = None
        # The most different of the samples that pass the filters, or first more, see `choose_by`;
        # chosen when the browser is opened or a filter changes, and kept while the view turns.
        self.different: NDArray[np.int64] | None = None
        # Place of the present TF.
        self.place: tuple[float, float] | None = None
        self._state = state
        self._latent = latent
        self._open_space = open_space
        self.taken: tuple[OpacityTF, Place] | None = None  # the last one, and its place
        self._volume: Volume | None = None
        self.window: Range = (0.0, 1.0)  # values that the map's TFs cover
        self.model: Path | None = None  # folder of a model that fits, whose codec can be chosen
        self._is_open = False
        say = self.problem.emit
        self._opening = LatestCall("latent-space", self, self._take_space, say)
        self._looking = LatestCall("latent-overview", self, self._take_overview, say)
        self._choosing = LatestCall("latent-choice", self, self._take_different, say)
        self._computing = LatestCall(
            "latent-map", self, self._take_places, lambda text: self._take_places((None, text))
        )
        self._calls = self._opening, self._looking, self._choosing, self._computing
        self._chosen_by: object = None
        self._embedding: EmbeddingProcess | None = None
        self._advanced.connect(self._report_progress, Qt.ConnectionType.QueuedConnection)
        latent.choicesChanged.connect(self._choices_changed)
        # At the end of each change: while the view turns, engines need the processors.
        state.inputsChangeFinished.connect(self._look)
        # Square pictures show more or less in an image of another shape.
        state.navigationChanged.connect(self._look)
        state.tf_input.changed.connect(lambda _tf: self._place_present())
        self._before = latent.choices

    @property
    def is_embedding(self) -> bool:
        """True while t-SNE is computed."""
        return self._embedding is not None

    def start_volume(self, volume: Volume, window: Range) -> None:
        """Set another volume; its space is opened when the browser is shown."""
        if volume is not self._volume:
            # Filters of the previous volume mean nothing here.
            self._latent.start_choices()
            self._latent.choose(band=None, on_map=False)
        self._volume, self.window = volume, window
        self.reset()

    def reset(self) -> None:
        """Reopen the space, now or when the browser is next shown."""
        self.cancel()
        for call in (self._opening, self._looking, self._choosing):
            call.forget()
        self.space = self.map = self.overview = self.place = None
        self.wanted = self.chosen = self.different = self._chosen_by = None
        self._is_open = False
        self.mapChanged.emit(None)
        self._ensure_open()

    def cancel(self) -> None:
        """Cancel the computation of the map; the present places stay."""
        if self._embedding is not None:
            self._embedding.cancel()
            self._embedding = None
            self._computing.forget()
            self.progressed.emit(1.0)

    def stop(self) -> None:
        """Ask all threads and processes to end; returns at once."""
        for call in self._calls:
            call.stop()
        self.cancel()

    def join(self) -> None:
        """Wait until all threads have ended."""
        for call in self._calls:
            call.join()

    def tf_at(self, place: tuple[float, float], closeness: float = 1.0) -> tuple[OpacityTF, int]:
        """Opacity TF at a place of the map, and how many samples it blends; see :meth:`code_at`."""
        assert self.space is not None
        code, samples = self.code_at(place, closeness)
        return self.space.tf_of(code), samples

    def code_at(
        self, place: tuple[float, float], closeness: float = 1.0
    ) -> tuple[NDArray[np.float32], int]:
        """Code (d,) at a place of the map, and how many samples it blends."""
        assert self.map is not None
        blend = (self.chosen or self.map).at(place, closeness)
        return blend.code, blend.samples

    def compute_map(self) -> None:
        """Compute the final places of the map, unless they are known."""
        is_busy = self._embedding is not None
        if self.map is None or self.space is None or is_busy or self.map.is_final:
            return
        process = self._embedding = EmbeddingProcess(self.map.codes)
        self.progressed.emit(0.0)
        progress = partial(self._advanced.emit, process)
        self._computing.ask(partial(_embed, process, self.space, self.map, progress))

    def _report_progress(self, process: EmbeddingProcess, done: float) -> None:
        if process is self._embedding:
            self.progressed.emit(done)

    def _choices_changed(self, choices: LatentChoices) -> None:
        before, self._before = self._before, choices
        if choices.shown and not before.shown:
            # The computation may have been cancelled earlier.
            self.compute_map()
            self._chosen_by = None
        if choices.codec != before.codec:
            self.reset()
        else:
            self._ensure_open()
            self._look()
            self._filter()
            self._place_present()

    def _filter(self) -> None:
        map_, latent = self.map, self._latent
        if map_ is None:
            return
        wanted = np.ones(len(map_.codes), dtype=bool)
        if latent.choices.band is not None and self.overview is not None:
            wanted &= self.overview.shows(latent.choices.band, self._state.scalar_range)
        if self.wanted is None or not np.array_equal(wanted, self.wanted):
            self.wanted = wanted
            self.chosen = map_.only(wanted) if wanted.any() else None
            self.filterChanged.emit()
        self._choose_different()

    def _choose_different(self) -> None:
        """Choose the most different samples again, if the browser was opened or filters changed."""
        by = (self._latent.choices.band,)
        if self._has_overview and by != self._chosen_by:
            assert self.overview is not None and self.wanted is not None
            self._chosen_by = by
            self._choosing.ask(partial(most_different, self.overview, self.wanted))

    def choose_by(self, images: NDArray[np.float32], usual: float) -> None:
        """Choose from too many different samples by their images, given the usual brightness."""
        assert self.different is not None
        self._choosing.ask(partial(chosen_by, images, usual, self.different))

    def _take_different(self, different: NDArray[np.int64]) -> None:
        self.different = different
        self.differentChanged.emit()
        self.marksChanged.emit()

    @property
    def _has_overview(self) -> bool:
        return self.overview is not None and self.overview_of == _seen_by(self._state.square_inputs)

    def _ensure_open(self) -> None:
        if not self._latent.choices.shown or self._volume is None or self._is_open:
            return
        self._is_open = True
        self.problem.emit("")
        folder = self.model if self._latent.choices.codec == "model" else None
        place = self._volume.scalar_range, self.window, self._volume.scale, folder
        self._opening.ask(partial(_open, partial(self._open_space, *place)))

    def _take_space(self, opened: Any) -> None:
        if not self._is_open:
            return
        self.space, map_ = opened
        self.overview = None
        self._show_map(map_)
        self._look()
        self.compute_map()

    def _take_places(self, answer: tuple[Places | None, str]) -> None:
        places, problem = answer
        self._embedding = None
        self.progressed.emit(1.0)
        if places is not None and self.map is not None:
            self._show_map(self.map.moved(places))
        if problem:
            self.problem.emit(problem)

    def _show_map(self, map_: LatentMap) -> None:
        self.map = map_
        self.wanted = self.chosen = self.taken = None
        self._filter()
        self._latent.start_choices()
        self.mapChanged.emit(map_)
        self._place_present()

    def _place_present(self) -> None:
        if self.map is None or self.space is None or not self._latent.choices.shown:
            return
        tf = self._state.transfer_function.opacity
        if self.taken is not None and self.taken[0] == tf:
            self.place = self.taken[1]
        else:
            self.place = self.map.place(self.space.code_of(tf))
        self.marksChanged.emit()

    def _look(self) -> None:
        map_, space, volume = self.map, self.space, self._volume
        if map_ is None or space is None or volume is None or not self._latent.choices.shown:
            return
        if self._has_overview:
            # Another view's overview may be on its way.
            self._looking.forget()
            return
        self._looking.ask(partial(self._overview, volume, self._state.square_inputs, space, map_))

    def _overview(
        self, volume: Volume, inputs: SceneInputs, space: LatentSpace, map_: LatentMap
    ) -> tuple[LatentMap, SceneInputs, Overview]:
        from model.latent.tiny_pictures import overview_of

        self.looked.emit(0.0)
        tfs = space.frame.stretched(map_.samples.tfs)
        return map_, inputs, overview_of(volume, inputs, tfs, progress=self.looked.emit)

    def _take_overview(self, answer: Any) -> None:
        map_, inputs, overview = answer
        if self.map is not None and map_.samples is self.map.samples:
            self.overview, self.overview_of = overview, _seen_by(inputs)
            self._filter()
            self.overviewChanged.emit(overview)


def _open(open_space: Callable[[], LatentSpace]) -> tuple[LatentSpace, LatentMap]:
    space = open_space()
    return space, space.open_map()


def _embed(
    process: EmbeddingProcess,
    space: LatentSpace,
    map_: LatentMap,
    progress: Callable[[float], None],
) -> tuple[Places | None, str]:
    """Compute the map's places, and keep them for the next time."""
    places = process.run(progress)
    if places is not None:
        try:
            space.keep_map(map_.codes, places)
        except LatentError as error:
            return places, str(error)
    return places, ""


def _seen_by(inputs: SceneInputs) -> tuple[object, ...]:
    """Return the inputs that an overview depends on."""
    return inputs.view, inputs.part, inputs.mask, inputs.color_tf
