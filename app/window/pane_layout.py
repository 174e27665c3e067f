"""The row of images: which are shown, on which side, and how wide."""

from collections.abc import Sequence

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QApplication, QSplitter, QWidget

from app.controls import Painted
from app.image_view.engine_pane import EnginePane
from app.latent_browser.latent_browser import LatentBrowser
from app.state.settings import Shown

LEAST_IMAGE = 0.35  # least share of the width for the image next to the latent browser


class PaneLayout(QSplitter):
    """Puts the latent browser, the generator's image and the reference side by side.

    The reference is A where B, to its right, is compared with it, in the generator's place.
    """

    arranged = Signal()  # emitted when an image was shown, hidden or moved to the other side
    bothAsked = Signal()

    is_browsing = Painted(False, "_update")  # with the latent browser in the generator's place
    has_model = Painted(False, "_update")  # whether a generator's image could be shown
    shown = Painted[Shown]("both", "_update")  # the images that the user wants to see
    is_enough = Painted(False, "_update")  # whether the reference is, until two are asked for

    def __init__(self, browser: LatentBrowser, panes: Sequence[EnginePane]) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._browser, self._panes = browser, panes
        self._generator, self._reference, self._pane_b = panes
        self.compares = False  # whether B is shown; then the latent browser is not
        self._wipes = False
        # Images touch: Qt reacts to the mouse some pixels next to the line, too.
        self.setHandleWidth(1)
        self.setChildrenCollapsible(False)
        browser.resized.connect(self._fit_browser)
        for widget, stretch in ((browser, 2), *((pane, 1) for pane in panes)):
            self.addWidget(widget)
            self.setStretchFactor(self.count() - 1, stretch)
        self._update()

    @property
    def is_swapped(self) -> bool:
        """Whether the reference is on the left."""
        return self.indexOf(self._reference) == 0

    @property
    def images(self) -> list[EnginePane]:
        """Panes of the visible images, from left to right."""
        there = [pane for pane in self._panes if not pane.isHidden()]
        return sorted(there, key=self.indexOf)

    @property
    def can_compare(self) -> bool:
        """Whether there are a generator's image and the reference to show."""
        return self.has_model and not (self.is_browsing or self.compares)

    @property
    def wipes(self) -> bool:
        """Whether A and B are in one image."""
        return self._wipes and self.compares

    def show_b(self, compares: bool, wipes: bool | None = None) -> None:
        """Show or hide B: next to A or, if it `wipes`, in the same image; None for as before."""
        wipes = self._wipes if wipes is None else wipes
        if (compares, wipes) != (self.compares, self._wipes):
            self.compares, self._wipes = compares, wipes
            self._update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the latent browser's squares as high as the images."""
        super().resizeEvent(event)
        self._fit_browser()

    def toggle_both(self, alone: Shown = "reference") -> None:
        """Show one image alone or, if a single one is shown, ask for both."""
        if len(self.images) > 1:
            self.shown = alone
        else:
            self.shown = "both"
            self.bothAsked.emit()

    def swap(self) -> None:
        """Move the reference to the other side."""
        self.insertWidget(2 if self.is_swapped else 0, self._reference)
        self.arranged.emit()

    def _update(self) -> None:
        both = self.shown == "both" and not self.is_enough
        # At least one image is always shown.
        alone = self.shown == "generator" and self.can_compare
        generator = alone or (both and self.can_compare)
        focus = QApplication.focusWidget()
        before = self.images
        parts = *before, self._browser
        had = [part for part in parts if focus is not None and part.isAncestorOf(focus)]
        self._browser.setVisible(self.is_browsing)
        self._generator.setVisible(generator)
        self._reference.setVisible(not alone)
        self._pane_b.setVisible(self.compares and not self._wipes)
        self._fit_browser()
        if self.images != before and not self.is_browsing:
            self.setSizes([1000 * (not each.isHidden()) for each in self._in_order()])
        if had and had[0].isHidden():
            # Otherwise a number box would get the hidden image's keys.
            self.images[0].canvas.setFocus()
        self.arranged.emit()

    def _fit_browser(self) -> None:
        """Make the browser as wide as its squares at this height, next to an image."""
        if not self.is_browsing:
            return
        width = self.width() - self.handleWidth()
        browser = min(self._browser.width_for(self.height()), round((1 - LEAST_IMAGE) * width))
        widths = {self._browser: browser, self._reference: width - browser}
        self.setSizes([widths.get(widget, 0) for widget in self._in_order()])

    def _in_order(self) -> list[QWidget]:
        parts: list[QWidget] = [self._browser, *self._panes]
        return sorted(parts, key=self.indexOf)
