"""Pictures of the map: the grid of cells, and the place under the mouse."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QTimer, Signal

from app.engines.channels import EngineName
from app.engines.client import Channel
from app.engines.messages import Result
from app.engines.quality import Quality
from app.engines.requests import BatchRequest, Request
from app.state.at_work import AtWork
from app.state.latent_drawer import CELL_SIZE, LatentDrawer, look_of
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState, Place
from app.state.viewer_state import ViewerState
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import OpacityTF

if TYPE_CHECKING:
    from model.latent.interpolation import Cells
    from model.latent.latent_map import LatentMap

REST_MS = 160
"""Time without a movement after which a picture is drawn at full size."""

HOVER_SECONDS, GRID_SECONDS = 0.05, 0.25
"""Time that a picture usually takes while the mouse moves, and 16 of them while the brush does."""

REST_SIZE = 256

Images = NDArray[np.float32]
Asked = TypeVar("Asked")


@dataclass(frozen=True, eq=False)
class HoverPicture:
    """Picture of a place of the map.

    Attributes
    ----------
    samples : int
        Samples that are blended; 0 where the nearest one stands for the place.
    image : ndarray of float32, shape (S, S, 4)
    source : {"exact", "learned"}
    of_code : bool
        Whether it is drawn from the code, not from the TF.
    """

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
    tfs : tuple of 16 (OpacityTF or None), row by row
        None for cells without samples.
    images : dict of int to ndarray
        Pictures (S, S, 4) of the cells that have one.
    inputs : SceneInputs
        View, light and colours of the pictures.
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


@dataclass(frozen=True, eq=False)
class _AskedGrid:
    map: LatentMap
    cells: Cells
    tfs: tuple[OpacityTF | None, ...]
    drawn: tuple[int, ...]


class LatentPictures(QObject):
    """Asks engines for pictures whenever brush, mouse, view, light or colours change.

    Attributes
    ----------
    grid_at_work : AtWork
        Tells that the grid's pictures take long.
    """

    gridDrawn = Signal(object)
    hoverDrawn = Signal(object)
    """Emitted with a :class:`HoverPicture`, or None when the mouse has left."""
    hoverMoved = Signal(object)
    """Emitted with the decoded TF under the mouse at once, or None."""
    problem = Signal(str)

    def __init__(
        self,
        state: ViewerState,
        latent: LatentState,
        session: LatentSession,
        drawer: LatentDrawer,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self.grid: GridPicture | None = None
        self.hover: HoverPicture | None = None
        self.drawer = drawer
        self._state = state
        self._latent = latent
        self._session = session
        self._is_path_traced = False
        self._grids = drawer.opened("grid", self._take_grid)
        self.grid_at_work = AtWork(self._grids.values(), self)
        self._hovers = drawer.opened("hover", self._take_hover)
        self._asked_hovers: dict[int, int] = {}
        """Numbers of samples that are blended, by request."""
        self._asked_grids: dict[int, _AskedGrid] = {}
        self._grid_key: object = None
        self._hover_rest = QTimer(self, singleShot=True, interval=REST_MS)
        self._hover_rest.timeout.connect(lambda: self._ask_hover(live=False))
        state.inputsChangeFinished.connect(self.ask)
        latent.brushChanged.connect(lambda _brush: self._ask_grid(live=latent.dragging))
        latent.brushChangeFinished.connect(self._ask_grid)
        latent.hoverChanged.connect(self._hover_changed)
        latent.choicesChanged.connect(lambda _choices: self.ask())
        session.mapClosed.connect(self.forget)
        session.mapChanged.connect(lambda _map: self.ask())
        session.filterChanged.connect(self._ask_grid)
        session.filterChanged.connect(lambda: self._ask_hover(live=False))

    def set_learned(self, size: int | None) -> None:
        """Set the image size of a generator that fits the volume; None without one."""
        if size != self.drawer.learned_size:
            self.drawer.set_learned(size)
            # What the engine before was asked for may never come.
            self._grid_key = None
            self.ask()

    def is_fresh(self, picture: GridPicture | None) -> bool:
        """Whether pictures are of the present view, light and colours."""
        return picture is not None and look_of(picture.inputs) == look_of(self._state.inputs)

    def trace(self, is_path_traced: bool) -> None:
        """Have pictures at rest followed by traced ones, in path-traced light."""
        self._is_path_traced = is_path_traced

    def start_volume(self) -> None:
        """Forget all pictures and how long they took."""
        self.drawer.forget_times()
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

    def ask(self) -> None:
        """Ask for all pictures anew, at full size."""
        self._ask_grid()
        self._ask_hover(live=False)

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
            self.drawer.source, self.drawer.from_codes,
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
        inputs = [self.drawer.with_tf(tf) for tf in tfs if tf is not None]
        asked = _AskedGrid(map_, cells, tuple(tfs), tuple(int(index) for index in drawn))
        if not inputs:
            self._asked_grids.clear()
            none = np.empty((0, 1, 1, 4), np.float32)
            nothing = BatchRequest(self._state.inputs, Quality(1))
            self._show_grid(asked, none, 0.0, self.drawer.source, nothing)
            return
        seconds = GRID_SECONDS / len(inputs)
        quality = self.drawer.quality(CELL_SIZE, seconds, live)
        number = self.drawer.ask(self._grids, inputs, quality, codes[drawn])
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
        code, samples = self._session.code_at(place, latent.closeness)
        tf = space.tf_of(code)
        self.hoverMoved.emit(tf)
        quality = self.drawer.quality(REST_SIZE, HOVER_SECONDS, live)
        number = self.drawer.ask(self._hovers, [self.drawer.with_tf(tf)], quality, code[None])
        self._asked_hovers[number] = samples

    def _take_grid(self, source: EngineName, result: Result) -> None:
        asked = _pop(self._asked_grids, result.request.sequence)
        if result.value is None:
            self._grid_key = None
            return
        if asked is not None:
            self._show_grid(asked, result.value, result.seconds, source, result.request)
            self._trace(self._grids[source], result.request, self._asked_grids, asked)

    def _take_hover(self, source: EngineName, result: Result) -> None:
        asked = _pop(self._asked_hovers, result.request.sequence)
        if result.value is None:
            return
        if asked is not None:
            self.hover = HoverPicture(
                result.request.inputs.opacity_tf, asked, result.value[0],
                result.seconds, source, _is_of_codes(result.request),
            )  # fmt: skip
            self.hoverDrawn.emit(self.hover)
            self._trace(self._hovers[source], result.request, self._asked_hovers, asked)

    def _trace(
        self, channel: Channel, request: Request, table: dict[int, Asked], asked: Asked
    ) -> None:
        """Have pictures at rest traced that were drawn in the light which stands in."""
        stands_in = self._is_path_traced and channel.client is self.drawer.clients["exact"]
        is_due = stands_in and not (request.quality.live or channel.is_pending)
        if is_due and isinstance(request, BatchRequest) and not request.traced:
            table[channel.ask(replace(request, traced=True)).sequence] = asked

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


def _is_of_codes(request: Request) -> bool:
    return isinstance(request, BatchRequest) and bool(request.codes)


def _pop(asked: dict[int, Asked], sequence: int) -> Asked | None:
    """Take what was asked with a number, and forget what was asked before it."""
    found = asked.get(sequence)
    for number in [number for number in asked if number <= sequence]:
        del asked[number]
    return found
