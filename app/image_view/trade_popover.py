"""Costs of the stops from fast to exact in the present scene, as a table."""

from __future__ import annotations

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QHideEvent, QShowEvent
from PySide6.QtWidgets import QFrame, QGridLayout, QLabel, QVBoxLayout, QWidget

from app.engines.exactness import STOPS, Stop
from app.engines.pace import SCALES
from app.state.image_errors import LEAST_SAID, error_text, pace_text, rate_text
from app.state.reference_work import ReferenceWork

WIDTH = 400

WAITING = "Measured once the image at rest is there."
MEASURING = "Measuring {} of {} …"
MEASURED = "Measured in this scene, with {} x {} pixels at rest."


class TradePopover(QFrame):
    """Shows rate and error of images while something moves at each stop, as measured while open.

    Attributes
    ----------
    rows : dict
        Labels of rate, error, and what an image at rest comes to, by the stop.
    """

    def __init__(self, work: ReferenceWork, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self._trade, self._work = work.trade, work
        self.setProperty("role", "mode card")
        self.setFixedWidth(WIDTH)
        self.setAccessibleName("Speed against accuracy")
        self.status = QLabel()
        self.rows: dict[Stop, tuple[QLabel, QLabel, QLabel]] = {}
        self._lay_out()
        work.trade.changed.connect(self.refresh)

    def open_below(self, place: QPoint) -> None:
        """Open with the upper right corner at a place of the screen."""
        self.refresh()
        self.adjustSize()
        self.move(place.x() - self.width(), place.y())
        self.show()

    def showEvent(self, event: QShowEvent) -> None:
        """Measure what is to be shown."""
        super().showEvent(event)
        self._trade.watch(True)

    def hideEvent(self, event: QHideEvent) -> None:
        """Measure no more."""
        super().hideEvent(event)
        self._trade.watch(False)

    def refresh(self) -> None:
        """Show what is measured by now."""
        for name, (rate, error, rest) in self.rows.items():
            traded = self._trade.at(STOPS[name])
            rate.setText("" if traded is None else rate_text(traded.seconds))
            exact = traded is not None and traded.error < LEAST_SAID
            error.setText("exact" if exact else "" if traded is None else error_text(traded.error))
            rest.setText(self._rest_text(name))
        if self._trade.found:
            pixels = self._work.whole_raster()
            said = MEASURED.format(pixels.width, pixels.height)
            self.status.setText(f"{said}{self._alike_text()}")
        elif self._trade.begun:
            self.status.setText(MEASURING.format(self._trade.begun, len(SCALES)))
        else:
            self.status.setText(WAITING)

    def _rest_text(self, name: Stop) -> str:
        """Say what an image at rest comes to: an error, or how far samples are apart."""
        if self._work.settings.lighting == "path":
            return f"refined to {error_text(STOPS[name].error)}"
        return f"{self._work.resting_distance(name):g} voxel steps".removeprefix("0")

    def _alike_text(self) -> str:
        """Say which stops draw the same here while something moves; empty if all differ."""
        found = {name: self._trade.at(stop) for name, stop in STOPS.items()}
        groups: dict[float, list[str]] = {}
        for name, traded in found.items():
            if traded is not None:
                groups.setdefault(traded.scale, []).append(name.capitalize())
        (alike,) = [names for names in groups.values() if len(names) > 1] or [[]]
        finest = found["exact"]
        if len(alike) == len(STOPS) and finest is not None:
            return f"\nAll stops are the same here: all pixels at {rate_text(finest.seconds)}."
        return f"\n{' and '.join(alike)} are the same here." if alike else ""

    def _lay_out(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(12, 10, 12, 10)
        column.setSpacing(6)
        title = QLabel("Speed against accuracy, while something moves")
        title.setProperty("role", "title")
        column.addWidget(title)
        grid = QGridLayout()
        grid.setHorizontalSpacing(14)
        grid.setVerticalSpacing(2)
        for place, text in enumerate(("", "moving", "error", "at rest")):
            heading = QLabel(text)
            heading.setProperty("role", "dim")
            grid.addWidget(heading, 0, place)
        for number, (name, stop) in enumerate(STOPS.items(), 1):
            labels = QLabel(), QLabel(), QLabel()
            self.rows[name] = labels
            title = QLabel(f"{name.capitalize()}, {pace_text(stop)}")
            for place, label in enumerate((title, *labels)):
                grid.addWidget(label, number, place)
        grid.setColumnStretch(0, 1)
        column.addLayout(grid)
        self.status.setProperty("role", "dim")
        column.addWidget(self.status)
