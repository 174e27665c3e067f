"""Pictures of the map of TFs: the grid, and the place under the mouse.

The ray caster draws the decoded TF, which a click takes. On the map, a model draws the code itself,
as in the paper (section 5.2).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.background import Pause
from app.engines.client import Channels, EngineClient, EngineName, EngineState
from app.engines.messages import Result
from app.engines.pace import Pace
from app.engines.requests import BatchRequest, Quality
from app.state.latent_session import LatentSession, LatentState, OpenSpace, Place
from app.state.slow_answers import SlowAnswers
from app.state.viewer_state import ViewerState
from model.latent.latent_map import CELLS, Cells
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF

CELL_SIZE, HOVER_SIZE = 128, 256  # shorter sides of pictures at rest, in pixels
REST_MS = 160  # pause of the mouse after which its place is drawn at full size

HOVER_SECONDS, GRID_SECONDS = 0.05, 0.25
"""Usual time of a picture while the mouse moves, and of 16 while the brush moves."""

Images = NDArray[np.float32]
_T = TypeVar("_T")


@dataclass(frozen=True, eq=False)
class HoverPicture:
    """Picture of a place of the map: the mean of some samples, or the nearest sample if 0."""

    tf: OpacityTF
    samples: int
    image: Images
    source: EngineName


@dataclass(frozen=True, eq=False)
class GridPicture:
    """Pictures of the TFs that differ most, or of the cells of the brushed rectangle."""

    cells: Cells | None  # None for the most different TFs, which are samples of the map
    tfs: tuple[OpacityTF | None, ...]  # sixteen, row by row; None for cells without samples
    places: NDArray[np.float32]  # on the map (16, 2): of the samples, or their means
    inputs: SceneInputs
    source: EngineName
    images: dict[int, Images]  # pictures (S, S, 4) of the cells that have one
    exposures: dict[int, float]  # factors of brightness of the most different TFs


class LatentPictures(QObject):
    """Requests pictures whenever brush, mouse, view, light or colours change."""

    gridDrawn = Signal(object)  # emitted with a :class:`GridPicture`, or None without any
    hoverDrawn = Signal(object)  # emitted with a :class:`HoverPicture`; None without the mouse
    hoverMoved = Signal(object)  # emitted with the decoded TF under the mouse at once, or None
    problem = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        clients: Mapping[EngineName, EngineClient],
        open_space: OpenSpace,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.state = latent
        self.session = LatentSession(state, latent, open_space, self)
        self.grid: GridPicture | None = None
        self._state = state
        self._model_size: int | None = None
        # Whether path-traced pictures follow those at rest; time of live pictures, in usual times;
        # the image whose proportions the picture of the place under the mouse has.
        self.is_path_traced: Callable[[], bool] = lambda: False
        self.patience: Callable[[], float] = lambda: 1.0
        self.raster: Callable[[], Raster] = lambda: Raster(HOVER_SIZE, HOVER_SIZE)
        self._pace = Pace()
        self._grids = Channels(clients, "grid", self._take_grid, self)
        self._hovers = Channels(clients, "hover", self._take_hover, self)
        self.slow_grid = SlowAnswers(self._grids.values(), self)
        self._asked_grids: dict[int, GridPicture] = {}  # without their pictures, by request
        self._asked_hovers: dict[int, int] = {}  # numbers of blended samples, by request
        self._grid_key: object = None
        self._hover_rest = Pause(self, REST_MS, lambda: self._ask_hover(live=False))
        for changed in (
            state.inputsChangeFinished, state.navigationChanged,
            latent.choicesChanged, self.session.filterChanged,
        ):  # fmt: skip
            changed.connect(self.ask)
        latent.brushChanged.connect(lambda _brush: self._ask_grid(live=latent.dragging))
        latent.hoverChanged.connect(self._hover_changed)
        self.session.mapChanged.connect(lambda map_: self._forget() if map_ is None else self.ask())
        # Coarse pictures come first, in a fraction of the time.
        self.session.differentChanged.connect(lambda: self._ask_grid(live=True))
        self.exact = clients["exact"]
        self.exact.stateChanged.connect(self._check_failure)

    @property
    def from_codes(self) -> bool:
        """Whether pictures are drawn from codes, not from the TFs that these are decoded to."""
        choices = self.state.choices
        has_codes = self._model_size is not None and self.session.model is not None
        return has_codes and choices.codec == "model" and choices.on_map

    def set_model(self, folder: Path | None, size: int | None) -> None:
        """Set a model that fits the volume, and the size of its images."""
        if folder != self.session.model:
            self.state.choose(codec="shipped")
            self.session.model = folder
        if size != self._model_size:
            self._model_size = size
            # The previous engine may never answer.
            self._grid_key = None
            self.ask()

    def is_fresh(self, picture: GridPicture) -> bool:
        """Whether pictures are of the present view, light and colours."""
        return _look_of(picture.inputs) == _look_of(self._square_inputs)

    @property
    def _square_inputs(self) -> SceneInputs:
        """Inputs of the grid's pictures; a model knows views at its own distances."""
        return self._state.inputs if self.from_codes else self._state.square_inputs

    def restart(self) -> None:
        """Request all pictures from a restarted engine."""
        self._pace = Pace()
        self._forget()
        self.ask()

    def stop(self) -> None:
        """Send no more requests, and ask all threads and processes to end; returns at once."""
        self._hover_rest.stop()
        self.session.stop()

    def ask(self) -> None:
        """Request all pictures again, at full size."""
        self._ask_grid()
        self._ask_hover(live=False)

    def _check_failure(self, state: EngineState) -> None:
        if state is EngineState.FAILED and self.state.choices.shown:
            self.problem.emit(self.exact.text)

    def _forget(self) -> None:
        self._grids.cancel()
        self._forget_hover()
        self._forget_grid()

    def _ask_grid(self, live: bool = False) -> None:
        session, on_map = self.session, self.state.choices.on_map
        space, map_, different = session.space, session.chosen, session.different
        if space is None or not self.state.choices.shown:
            return
        if map_ is None or (different is None and not on_map):
            # Nothing passes the filters, or nothing is chosen yet.
            self._forget_grid()
            return
        inputs = self._square_inputs
        key = (
            _look_of(inputs), self.from_codes,
            *((map_, self.state.brush) if on_map else (session.map, id(different))),
        )  # fmt: skip
        if key == self._grid_key:
            # An edit of the opacity TF changes no picture of the map.
            return
        self._grid_key = None if live else key
        cells = map_.cells(self.state.brush) if on_map else None
        if cells is None:
            whole = session.map
            assert whole is not None and different is not None
            codes, places = whole.codes[different], whole.places[different]
            drawn = np.arange(len(different))
        else:
            codes, places = (part.reshape(CELLS**2, -1) for part in (cells.codes, cells.places))
            drawn = np.flatnonzero(cells.count)
        tfs: list[OpacityTF | None] = [None] * max(CELLS**2, len(drawn))
        for index, tf in zip(drawn, space.tfs_of(codes[drawn]), strict=True):
            tfs[index] = tf
        source: EngineName = "learned" if self.from_codes else "exact"
        asked = GridPicture(cells, tuple(tfs), places, inputs, source, {}, {})
        if len(drawn):
            wanted = [tf for tf in tfs if tf is not None]
            pictures = [replace(inputs, opacity_tf=tf) for tf in wanted]
            size = Raster.of(CELL_SIZE)
            number = self._ask(self._grids, pictures, codes[drawn], size, GRID_SECONDS, live)
            self._asked_grids[number] = asked
        else:
            self._asked_grids.clear()
            self._show_grid(asked)

    def _ask(
        self,
        channels: Channels[EngineName],
        pictures: list[SceneInputs],
        codes: NDArray[np.float32],
        raster: Raster,
        seconds: float,
        live: bool,
    ) -> int:
        """Request pictures, with their TFs' codes, and return the request's number."""
        source: EngineName = "learned" if self.from_codes else "exact"
        if live:
            seconds *= self.patience() / len(pictures)
            raster = raster.scaled(self._pace.scale(source, raster.side, seconds, 0.5))
        if self.from_codes and self._model_size is not None:
            raster = Raster.of(self._model_size)
        drawn = tuple(map(tuple, codes.tolist())) if self.from_codes else ()
        quality = Quality(raster.shorter, live=live, raster=raster)
        request = BatchRequest(pictures[0], quality, tuple(pictures[1:]), drawn)
        return channels[source].ask(request).sequence

    def _hover_changed(self, place: Place | None) -> None:
        if place is None or self.session.map is None:
            self._forget_hover()
        else:
            self._hover_rest.start()
            self._ask_hover(live=True)

    def _ask_hover(self, live: bool) -> None:
        place, space = self.state.hover, self.session.space
        if place is None or space is None:
            return
        code, samples = self.session.code_at(place, self.state.closeness)
        tf = space.tf_of(code)
        self.hoverMoved.emit(tf)
        inputs = replace(self._state.inputs, opacity_tf=tf)
        whole = self.raster()
        raster = whole.scaled(HOVER_SIZE / whole.shorter)
        number = self._ask(self._hovers, [inputs], code[None], raster, HOVER_SECONDS, live)
        self._asked_hovers[number] = samples

    def _take_grid(self, source: EngineName, result: Result) -> None:
        asked = self._taken(self._asked_grids, self._grids, source, result)
        if result.value is None:
            self._grid_key = None
        elif len(result.value) > CELLS**2:
            if not self._grids[source].is_pending:
                self.session.choose_by(result.value, self._state.brightness.usual[source])
        elif asked is not None:
            drawn = [index for index, tf in enumerate(asked.tfs) if tf is not None]
            exposures: dict[int, float] = {}
            if asked.cells is None:
                known, request = self.grid, result.request
                assert isinstance(request, BatchRequest)
                same = known and (known.tfs, known.inputs) == (asked.tfs, asked.inputs)
                if known and same and not request.traced:
                    # Finer pictures of the same TFs, in the same light, keep their brightness.
                    exposures = known.exposures
                else:
                    exposures = dict(zip(drawn, self._exposures(result.value, source), strict=True))
            images = dict(zip(drawn, result.value, strict=True))
            self._show_grid(replace(asked, images=images, exposures=exposures))
            if asked.cells is None and result.request.quality.live:
                self._ask_grid()

    def _exposures(self, images: Images, source: EngineName) -> list[float]:
        """Return by how much pictures are brightened, beyond the usual brightness."""
        from model.latent.tiny_pictures import exposures

        usual = self._state.brightness.usual[source]
        found = exposures(images[..., :3].reshape(len(images), -1, 3), usual) / usual
        return [float(factor) for factor in found]

    def _take_hover(self, source: EngineName, result: Result) -> None:
        samples = self._taken(self._asked_hovers, self._hovers, source, result)
        if result.value is not None and samples is not None:
            tf = result.request.inputs.opacity_tf
            self.hoverDrawn.emit(HoverPicture(tf, samples, result.value[0], source))

    def _taken(
        self,
        table: dict[int, _T],
        channels: Channels[EngineName],
        source: EngineName,
        result: Result,
    ) -> _T | None:
        """Take the request with an answer's number, and request path-traced pictures if due."""
        request = result.request
        asked = table.get(request.sequence)
        for number in [number for number in table if number <= request.sequence]:
            del table[number]
        if result.value is None:
            self.problem.emit(result.error or "The engine returned no pictures.")
            return None
        assert isinstance(request, BatchRequest)
        if not request.traced:
            seconds = result.seconds / len(result.value)
            self._pace.note(source, request.quality.pixels.side, seconds)
        waits = channels[source].is_pending
        due = self.is_path_traced() and source == "exact" and not (request.quality.live or waits)
        if asked is not None and due and not request.traced:
            table[channels[source].ask(replace(request, traced=True)).sequence] = asked
        return asked

    def _show_grid(self, grid: GridPicture) -> None:
        self.grid = grid
        self.gridDrawn.emit(grid)

    def _forget_grid(self) -> None:
        self._asked_grids.clear()
        self.grid = self._grid_key = None
        self.gridDrawn.emit(None)

    def _forget_hover(self) -> None:
        self._hover_rest.stop()
        self._hovers.cancel()
        self._asked_hovers.clear()
        self.hoverMoved.emit(None)
        self.hoverDrawn.emit(None)


def _look_of(inputs: SceneInputs) -> SceneInputs:
    """Inputs, other than the opacity TF, that pictures of the map depend on."""
    return replace(inputs, opacity_tf=replace(inputs.opacity_tf, modes=(), points=()))
