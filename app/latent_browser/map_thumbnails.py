"""Thumbnails on the map, where it is magnified so far that they fit between one another."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QImage, QPainter, QPen

from app.image_view.image_canvas import to_qimage
from app.latent_browser.map_colors import Shades
from app.latent_browser.map_frame import WHEEL_FACTOR, MapFrame
from app.latent_browser.point_cloud import THUMBNAIL, THUMBNAILS_FROM, apart
from app.state.brightness import Brightness
from app.state.latent_pictures import LatentPictures
from app.state.latent_session import LatentSession
from app.state.latent_thumbnails import LatentThumbnails


class MapThumbnails(QObject):
    """Chooses the samples whose thumbnails fit, has these drawn, and paints them.

    Parameters
    ----------
    session : LatentSession
    pictures : LatentPictures
    thumbnails : LatentThumbnails
    brightness : Brightness
    """

    changed = Signal()
    """Emitted when they are to be painted anew."""

    def __init__(
        self,
        session: LatentSession,
        pictures: LatentPictures,
        thumbnails: LatentThumbnails,
        brightness: Brightness,
        parent: QObject,
    ) -> None:
        super().__init__(parent)
        self._session, self._pictures = session, pictures
        self._small, self._brightness = thumbnails, brightness
        self._frame = MapFrame(1, 1)
        self._images: dict[int, QImage] = {}
        self._apart: tuple[float, NDArray[np.bool_] | None, NDArray[np.int64]] | None = None
        session.filterChanged.connect(self._renew)
        thumbnails.drawn.connect(self._renew)
        brightness.changed.connect(self._brighten)

    @property
    def factor(self) -> float:
        """Factor of the pictures' colours."""
        return self._brightness.of(self._pictures.drawer.source)

    @property
    def in_sight(self) -> list[int]:
        """Samples whose thumbnails are painted, or would be if they were drawn."""
        map_ = self._session.map
        if map_ is None or self._frame.zoom < THUMBNAILS_FROM:
            return []
        ones = self._far_apart()
        pixels = self._frame.pixels(map_.places[ones])
        half = THUMBNAIL / 2
        size = self._frame.width, self._frame.height
        inside = ((pixels > -half) & (pixels < np.add(size, half))).all(axis=1)
        return [int(index) for index in ones[inside]]

    def start(self) -> None:
        """Begin anew: there is another map."""
        self._apart = None
        self._images.clear()

    def show(self, frame: MapFrame) -> None:
        """Show another part of the map, and have its thumbnails drawn."""
        self._frame = frame
        self._small.want(self.in_sight)

    def at(self, pixel: QPointF) -> tuple[int, tuple[float, float]] | None:
        """Return the sample whose thumbnail is at a pixel, and its place; None without one."""
        map_, half = self._session.map, THUMBNAIL / 2
        if map_ is None:
            return None
        for index in self.in_sight:
            place = tuple(map_.places[index].tolist())
            offset = self._frame.pixel(place) - pixel
            if max(abs(offset.x()), abs(offset.y())) <= half and self._image(index):
                return index, place
        return None

    def paint(self, painter: QPainter, shades: Shades) -> None:
        """Paint them; pale what is of another scene or not wanted."""
        map_ = self._session.map
        assert map_ is not None
        half = THUMBNAIL / 2
        for index in self.in_sight:
            picture = self._image(index)
            if picture is None:
                continue
            at = self._frame.pixel(tuple(map_.places[index].tolist()))
            rect = QRectF(at.x() - half, at.y() - half, THUMBNAIL, THUMBNAIL)
            stale = index not in self._small.images
            painter.setOpacity(0.4 if stale or not shades.shown[index] else 1.0)
            painter.drawImage(rect, picture)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(QPen(QColor(*shades.colors[index].tolist()), 1.5))
            painter.drawRect(rect)
        painter.setOpacity(1.0)

    def _far_apart(self) -> NDArray[np.int64]:
        """Samples whose thumbnails do not overlap at this zoom, in steps of the wheel."""
        map_, wanted = self._session.map, self._session.wanted
        assert map_ is not None
        level = float(np.floor(np.log(self._frame.zoom) / np.log(WHEEL_FACTOR)))
        known = self._apart
        if known is None or known[0] != level or known[1] is not wanted:
            scale = replace(self._frame, zoom=WHEEL_FACTOR**level).scale
            some = np.arange(len(map_.codes)) if wanted is None else np.flatnonzero(wanted)
            ones = some[apart(map_.places[some], (THUMBNAIL + 3) / scale)]
            known = self._apart = level, wanted, ones
        return known[2]

    def _image(self, index: int) -> QImage | None:
        if index not in self._images:
            small = self._small
            image = small.images.get(index, small.stale.get(index))
            if image is None:
                return None
            self._images[index] = to_qimage(image, self.factor)
        return self._images[index]

    def _brighten(self) -> None:
        self._images.clear()
        self.changed.emit()

    def _renew(self) -> None:
        # What is drawn anew replaces what was stale.
        self._images.clear()
        self._small.want(self.in_sight)
        self.changed.emit()
