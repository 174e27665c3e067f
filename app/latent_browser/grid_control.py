"""The grid of pictures: which cell is taken, marked or zoomed into."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject

from app.latent_browser.cell_grid import CellGrid
from app.latent_browser.map_view import MapView
from app.latent_browser.preview import Preview
from app.state.latent_pictures import GridPicture, LatentPictures
from app.state.latent_state import LatentState, Place
from model.latent.latent_map import CELLS, Brush
from model.scene.transfer_function import OpacityTF

LEAST_SIDE = 0.01
"""Least side of a brush that a wheel's turn leads to."""


class GridControl(QObject):
    """Shows the pictures in the grid, and moves the brush by its wheel.

    Parameters
    ----------
    map_view : MapView
        Marks the cell under the mouse.
    take : callable
        Takes a TF, the edit's name, the TF's place and its exposure.
    """

    def __init__(
        self,
        grid: CellGrid,
        latent: LatentState,
        pictures: LatentPictures,
        map_view: MapView,
        preview: Preview,
        take: Callable[[OpacityTF, str, Place, float | None], None],
    ) -> None:
        super().__init__(grid)
        self._grid, self._latent, self._pictures = grid, latent, pictures
        self._map, self._preview, self._take = map_view, preview, take
        self._brushes: list[Brush] = []
        """Rectangles that the wheel returns to."""
        latent.brushChanged.connect(lambda _brush: self.forget_zooms())
        pictures.gridDrawn.connect(self._show)
        pictures.grid_at_work.changed.connect(grid.set_progress)
        grid.chosen.connect(self._choose)
        grid.zoomed.connect(self._zoom_into)
        grid.widened.connect(self._widen)
        grid.hovered.connect(self._hover)

    def forget_zooms(self) -> None:
        """Begin anew with the rectangles that the wheel returns to."""
        self._brushes.clear()

    def mark_stale(self) -> None:
        """Show whether the pictures are of the present inputs."""
        grid = self._pictures.grid
        if grid is not None and self._latent.choices.shown:
            self._grid.set_stale(not self._pictures.is_fresh(grid))

    def _show(self, picture: GridPicture | None) -> None:
        self._grid.show_grid(picture)
        self.mark_stale()

    def _choose(self, cell: int) -> None:
        grid, tf = self._pictures.grid, self._pictures.cell_tf(cell)
        if grid is not None and tf is not None:
            x, y = grid.places[cell].tolist()
            self._take(tf, "TF from the grid", (x, y), grid.exposures.get(cell))

    def _hover(self, cell: int | None) -> None:
        self._map.mark_cell(cell)
        self._preview.show_tf(None if cell is None else self._pictures.cell_tf(cell))

    def _zoom_into(self, cell: int) -> None:
        if not self._latent.choices.on_map:
            return
        left, lower, right, upper = self._latent.brush
        width, height = (right - left) / CELLS, (upper - lower) / CELLS
        if min(width, height) < LEAST_SIDE:
            return
        row, column = divmod(cell, CELLS)
        x, y = left + column * width, upper - (row + 1) * height
        self._set_brush((x, y, x + width, y + height), [*self._brushes, self._latent.brush])

    def _widen(self) -> None:
        """Return to the rectangle before the last zoom, or to one of twice the size."""
        if not self._latent.choices.on_map:
            return
        before = list(self._brushes)
        if before:
            brush = before[-1]
        else:
            left, lower, right, upper = self._latent.brush
            dx, dy = (right - left) / 2, (upper - lower) / 2
            brush = (
                min(left, max(left - dx, -1.0)), min(lower, max(lower - dy, -1.0)),
                max(right, min(right + dx, 1.0)), max(upper, min(upper + dy, 1.0)),
            )  # fmt: skip
        self._set_brush(brush, before[:-1])

    def _set_brush(self, brush: Brush, before: list[Brush]) -> None:
        """Set the rectangle, and those that the wheel returns to."""
        self._latent.set_brush(brush)
        self._brushes = before
        self._map.look_at(brush)
