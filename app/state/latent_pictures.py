"""Pictures of the map: the grid of cells, and the place under the mouse.

Drawn by whichever engine is chosen; automatically the ray caster, or the model where the ray
caster has proved too slow. A picture is that of the decoded TF, so that it is what a click on it
gives, or, by a model that draws codes, of the code itself, as in the paper (section 5.2).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.channels import Channels
from app.engines.client import Channel, EngineClient
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest, Request
from app.state.at_work import AtWork
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState, Place
from app.state.live_errors import LiveErrors
from app.state.pace import Pace
from app.state.viewer_state import ViewerState
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF

if TYPE_CHECKING:
    from model.latent.interpolation import Cells
    from model.latent.latent_map import LatentMap

EngineName = Literal["exact", "learned"]

REST_MS = 160
"""Time without a movement after which a picture is drawn at full size."""

HOVER_SECONDS, GRID_SECONDS = 0.05, 0.25
"""Time that a picture usually takes while the mouse moves, and 16 of them while the brush does."""

SLOW_SECONDS = 0.12
"""Expected time of a picture at which the model takes over, if there is one."""

REST_SIZE, CELL_SIZE = 256, 128
LIVE_SIZES = (128, 96, 64, 48, 32)
LEAST_TIMED_SIZE = 96

Images = NDArray[np.float32]
Asked = TypeVar("Asked")


@dataclass(frozen=True, eq=False)
class HoverPicture:
    """Picture of a place of the map.

    Attributes
    ----------
    place : tuple of float
    tf : OpacityTF
    samples : int
        Samples that are blended; 0 where the nearest one stands for the place.
    image : ndarray of float32, shape (S, S, 4)
    seconds : float
    source : {"exact", "learned"}
    of_code : bool
        Whether it is drawn from the code, not from the TF.
    """

    place: Place
    tf: OpacityTF
    samples: int
    image: Images
    seconds: float
    source: EngineName
    of_code: bool = False


@dataclass(frozen=True, eq=False)
class GridPicture:
    """Pictures of the cells of the brushed rectangle.

    Attributes
    ----------
    map : LatentMap
        The samples that were averaged.
    cells : Cells
    tfs : tuple of 16 (OpacityTF or None), row by row
        None for cells without samples.
    images : dict of int to ndarray
        Pictures (S, S, 4) of the cells that have one.
    inputs : SceneInputs
        View, light and colours of the pictures.
    seconds : float
    source : {"exact", "learned"}
    of_codes : bool
        Whether they are drawn from codes, not from TFs.
    """

    map: LatentMap
    cells: Cells
    tfs: tuple[OpacityTF | None, ...]
    images: dict[int, Images]
    inputs: SceneInputs
    seconds: float
    source: EngineName
    of_codes: bool = False


@dataclass(frozen=True)
class _AskedHover:
    place: Place
    samples: int


@dataclass(frozen=True, eq=False)
class _AskedGrid:
    map: LatentMap
    cells: Cells
    tfs: tuple[OpacityTF | None, ...]
    drawn: tuple[int, ...]


class LatentPictures(QObject):
    """Asks engines for pictures whenever brush, mouse, view, light or colours change.

    Parameters
    ----------
    state : ViewerState
    latent : LatentState
    session : LatentSession
    exact : EngineClient
        Client of a ray caster.
    learned : EngineClient
        Client of the generator.
    errors : LiveErrors
        Is told of pictures, live and at rest.

    Attributes
    ----------
    clients : dict
        Both clients by name.
    learned_size : int or None
        Image size of a generator that fits the volume.
    draws_codes : bool
        Whether that generator draws the codes of its own codec.
    grid : GridPicture or None
    grid_at_work : AtWork
        Tells that the grid's pictures take long.
    hover : HoverPicture or None
    """

    gridDrawn = Signal(object)
    hoverDrawn = Signal(object)
    """Emitted with a :class:`HoverPicture`, or None when the mouse has left."""
    hoverMoved = Signal(object)
    """Emitted with the decoded TF under the mouse at once, or None."""
    asked = Signal()
    """Emitted when all pictures are asked for anew."""
    restarted = Signal()
    """Emitted when another engine draws: what the one before was asked for may never come."""
    forgotten = Signal()
    """Emitted when all pictures are forgotten, as they are of another volume or map."""
    problem = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        session: LatentSession,
        exact: EngineClient,
        learned: EngineClient,
        errors: LiveErrors,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.grid: GridPicture | None = None
        self.hover: HoverPicture | None = None
        self.learned_size: int | None = None
        self.draws_codes = False
        self._state = state
        self._latent = latent
        self._session = session
        self._errors = errors
        self.clients: dict[EngineName, EngineClient] = {"exact": exact, "learned": learned}
        self._pace = Pace()
        self._patience = 1.0
        self._is_path_traced = False
        self._warm: set[EngineName] = set()
        self._grids = self.opened("grid", self._take_grid)
        self.grid_at_work = AtWork(self._grids.values(), self)
        self._hovers = self.opened("hover", self._take_hover)
        self._asked_hovers: dict[int, _AskedHover] = {}
        self._asked_grids: dict[int, _AskedGrid] = {}
        self._grid_key: object = None
        self._hover_rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._hover_rest.timeout.connect(lambda: self._ask_hover(live=False))
        state.inputsChanged.connect(self._ask_live)
        state.inputsChangeFinished.connect(self.ask)
        latent.brushChanged.connect(lambda _brush: self._ask_grid(live=latent.dragging))
        latent.brushChangeFinished.connect(self._ask_grid)
        latent.hoverChanged.connect(self._hover_changed)
        latent.choicesChanged.connect(lambda _choices: self.ask())
        session.mapClosed.connect(self.forget)
        session.mapChanged.connect(lambda _map: self.ask())
        session.filterChanged.connect(self._ask_grid)
        session.filterChanged.connect(lambda: self._ask_hover(live=False))

    @property
    def source(self) -> EngineName:
        """The engine that draws."""
        choice = self._latent.choices.engine
        if self.learned_size is None or choice == "exact":
            return "exact"
        if choice == "learned" or (self.has_own_codes and self._latent.choices.drawn == "code"):
            return "learned"
        expected = self._pace.expected("exact", CELL_SIZE)
        return "learned" if expected is not None and expected > SLOW_SECONDS else "exact"

    @property
    def from_codes(self) -> bool:
        """Whether pictures are drawn from codes, not from the TFs that these are decoded to."""
        wanted = self.has_own_codes and self._latent.choices.drawn == "code"
        return wanted and self.source == "learned"

    @property
    def has_own_codes(self) -> bool:
        """Whether the map's codes are those of a model that draws them."""
        return self.draws_codes and self._session.has_models_codec

    def size_of(self, source: EngineName, size: int) -> int:
        """Size of an engine's pictures where one would do: a generator has its own."""
        return (self.learned_size or size) if source == "learned" else size

    def set_learned(self, size: int | None) -> None:
        """Set the image size of a generator that fits the volume; None without one."""
        if size != self.learned_size:
            self.learned_size = size
            # What the engine before was asked for may never come.
            self._grid_key = None
            self.restarted.emit()
            self.ask()

    def is_fresh(self, picture: GridPicture | None) -> bool:
        """Whether pictures are of the present view, light and colours."""
        return picture is not None and look_of(picture.inputs) == look_of(self._state.inputs)

    def allow(self, patience: float) -> None:
        """Have live pictures take so many times the usual time, from the next on."""
        self._patience = patience

    def trace(self, is_path_traced: bool) -> None:
        """Have pictures at rest followed by traced ones, in path-traced light."""
        self._is_path_traced = is_path_traced

    def start_volume(self) -> None:
        """Forget all pictures and how long they took."""
        self._pace = Pace()
        self._warm.clear()
        self.forget()

    def stop(self) -> None:
        """Ask nothing any more."""
        self._hover_rest.stop()

    def forget(self) -> None:
        """Forget all pictures, and call off what was asked for."""
        self._grids.cancel()
        self._hovers.cancel()
        self.grid = self.hover = self._grid_key = None
        self._asked_grids.clear()
        self._asked_hovers.clear()
        self.gridDrawn.emit(None)
        self.hoverMoved.emit(None)
        self.hoverDrawn.emit(None)
        self.forgotten.emit()

    def ask(self) -> None:
        """Ask for all pictures anew, at full size."""
        self._ask_grid()
        self._ask_hover(live=False)
        self.asked.emit()

    def cell_tf(self, index: int) -> OpacityTF | None:
        """Opacity TF of a cell, row by row; None for an empty one."""
        return None if self.grid is None else self.grid.tfs[index]

    def cell_place(self, index: int) -> Place | None:
        """Mean place of a cell's samples, row by row; that of the nearest for an empty cell."""
        if self.grid is None:
            return None
        cells, map_ = self.grid.cells, self.grid.map
        place = cells.places.reshape(-1, 2)[index]
        if not cells.count.flat[index]:
            place = map_.places[cells.nearest.flat[index]]
        return float(place[0]), float(place[1])

    def _ask_live(self) -> None:
        if self._state.live:
            self._ask_grid(live=True)

    def _ask_grid(self, live: bool = False) -> None:
        space, map_ = self._session.space, self._session.chosen
        if space is None or not self._latent.choices.shown:
            return
        if map_ is None:
            # Nothing passes the filters.
            self._asked_grids.clear()
            self.grid = self._grid_key = None
            self.gridDrawn.emit(None)
            return
        key = (
            look_of(self._state.inputs), map_, self._latent.brush, self._latent.choices.nearest,
            self.source, self.from_codes,
        )  # fmt: skip
        if key == self._grid_key:
            # An edit of the opacity TF changes no picture of the map.
            return
        self._grid_key = None if live else key
        cells = map_.cells(self._latent.brush)
        codes = cells.codes.reshape(cells.count.size, -1).copy()
        drawn = np.flatnonzero(cells.count.ravel() > 0)
        if self._latent.choices.nearest:
            empty = np.flatnonzero(cells.count.ravel() == 0)
            codes[empty] = map_.codes[cells.nearest.ravel()[empty]]
            drawn = np.arange(len(codes))
        tfs: list[OpacityTF | None] = [None] * len(codes)
        for index, tf in zip(drawn, space.tfs_of(codes[drawn]), strict=True):
            tfs[index] = tf
        inputs = [self.with_tf(tf) for tf in tfs if tf is not None]
        asked = _AskedGrid(map_, cells, tuple(tfs), tuple(int(index) for index in drawn))
        if not inputs:
            self._asked_grids.clear()
            none = np.empty((0, 1, 1, 4), np.float32)
            nothing = BatchRequest(self._state.inputs, Quality(1))
            self._show_grid(asked, none, 0.0, self.source, nothing)
            return
        seconds = GRID_SECONDS / len(inputs)
        quality = self._quality(CELL_SIZE, seconds, live)
        number = self.ask_for(self._grids, inputs, quality, codes[drawn])
        self._asked_grids[number] = asked

    def _hover_changed(self, place: Place | None) -> None:
        if place is None or self._session.map is None:
            self._hover_rest.stop()
            self._asked_hovers.clear()
            self.hover = None
            self.hoverMoved.emit(None)
            self.hoverDrawn.emit(None)
            return
        self._hover_rest.start()
        self._ask_hover(live=True)

    def _ask_hover(self, live: bool) -> None:
        place = self._latent.hover
        if place is None or self._session.map is None:
            return
        latent, space = self._latent, self._session.space
        assert space is not None
        code, samples = self._session.code_at(place, latent.hover_sample, latent.closeness)
        tf = space.tf_of(code)
        self.hoverMoved.emit(tf)
        quality = self._quality(REST_SIZE, HOVER_SECONDS, live)
        number = self.ask_for(self._hovers, [self.with_tf(tf)], quality, code[None])
        self._asked_hovers[number] = _AskedHover(place, samples)

    def _quality(self, largest: int, seconds: float, live: bool) -> Quality:
        if not live:
            return Quality(largest)
        expected, seconds = self._pace.expected(self.source, 1) or 0.0, seconds * self._patience
        sizes = (size for size in LIVE_SIZES if expected * size**2 <= seconds)
        return Quality(min(largest, next(sizes, LIVE_SIZES[-1])), live=True)

    def opened(self, name: str, take: Callable[[EngineName, Result], None]) -> Channels[EngineName]:
        """Open channels to both engines, whose answers are taken, and their problems told."""
        return Channels(self.clients, name, partial(self._take, take), self)

    def ask_for(
        self,
        channels: Channels[EngineName],
        inputs: list[SceneInputs],
        quality: Quality,
        codes: NDArray[np.float32],
    ) -> int:
        """Ask for pictures of some TFs with their codes (n, d), and return the request's number."""
        source = self.source
        quality = replace(quality, size=self.size_of(source, quality.size))
        request = BatchRequest(inputs[0], quality, tuple(inputs[1:]), self._drawn(codes))
        return channels[source].ask(request).sequence

    def _drawn(self, codes: NDArray[np.float32]) -> tuple[tuple[float, ...], ...]:
        """Codes (n, d) to draw; none where it is their TFs that are drawn."""
        return tuple(map(tuple, codes.tolist())) if self.from_codes else ()

    def with_tf(self, tf: OpacityTF) -> SceneInputs:
        """Present inputs under another opacity TF."""
        return replace(self._state.inputs, opacity_tf=tf)

    def _take(
        self, take: Callable[[EngineName, Result], None], source: EngineName, result: Result
    ) -> None:
        if result.value is not None and not _is_traced(result.request):
            seconds = result.seconds / len(result.value)
            self._note_pace(source, result.request.quality.size, seconds)
        take(source, result)
        if result.value is None:
            self.problem.emit(result.error or "The engine returned no pictures.")

    def _take_grid(self, source: EngineName, result: Result) -> None:
        asked = _pop(self._asked_grids, result.request.sequence)
        if result.value is None:
            self._grid_key = None
            return
        self._compare(source, result)
        if asked is not None:
            self._show_grid(asked, result.value, result.seconds, source, result.request)
            self._trace(self._grids[source], result.request, self._asked_grids, asked)

    def _take_hover(self, source: EngineName, result: Result) -> None:
        asked = _pop(self._asked_hovers, result.request.sequence)
        if result.value is None:
            return
        self._compare(source, result)
        if asked is not None:
            self.hover = HoverPicture(
                asked.place, result.request.inputs.opacity_tf, asked.samples, result.value[0],
                result.seconds, source, _is_of_codes(result.request),
            )  # fmt: skip
            self.hoverDrawn.emit(self.hover)
            self._trace(self._hovers[source], result.request, self._asked_hovers, asked)

    def _trace(
        self, channel: Channel, request: Request, table: dict[int, Asked], asked: Asked
    ) -> None:
        """Have pictures at rest traced that were drawn in the light which stands in."""
        stands_in = self._is_path_traced and channel.client is self.clients["exact"]
        is_due = stands_in and not (request.quality.live or channel.is_pending)
        if is_due and isinstance(request, BatchRequest) and not request.traced:
            table[channel.ask(replace(request, traced=True)).sequence] = asked

    def _compare(self, source: EngineName, result: Result) -> None:
        assert result.value is not None
        seconds = result.seconds / len(result.value)
        self._errors.take("map", source, result.request, result.value, seconds)

    def _note_pace(self, source: EngineName, size: int, seconds: float) -> None:
        """Note the time of a picture, unless it says little about larger ones."""
        # The first one compiles; of small ones most of the time has nothing to do with pixels.
        if source in self._warm and size >= LEAST_TIMED_SIZE:
            self._pace.note(source, size, seconds)
        self._warm.add(source)

    def _show_grid(
        self,
        asked: _AskedGrid,
        images: Images,
        seconds: float,
        source: EngineName,
        request: Request,
    ) -> None:
        drawn = dict(zip(asked.drawn, images, strict=True))
        self.grid = GridPicture(
            asked.map, asked.cells, asked.tfs, drawn, request.inputs, seconds, source,
            _is_of_codes(request),
        )  # fmt: skip
        self.gridDrawn.emit(self.grid)


def _is_traced(request: Request) -> bool:
    return isinstance(request, BatchRequest) and request.traced


def _is_of_codes(request: Request) -> bool:
    return isinstance(request, BatchRequest) and bool(request.codes)


def _pop(asked: dict[int, Asked], sequence: int) -> Asked | None:
    """Take what was asked with a number, and forget what was asked before it."""
    found = asked.get(sequence)
    for number in [number for number in asked if number <= sequence]:
        del asked[number]
    return found


def look_of(inputs: SceneInputs) -> SceneInputs:
    """Inputs that pictures of the map depend on besides their own opacity TF."""
    return replace(inputs, opacity_tf=replace(inputs.opacity_tf, modes=(), points=()))
