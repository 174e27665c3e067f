"""The row of images: which of them are shown, on which side, and how wide."""

from __future__ import annotations

from typing import Literal

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QSplitter, QWidget

Shown = Literal["both", "generator", "reference"]
"""Images that the user wants to see, as far as they are there."""


class PaneLayout(QSplitter):
    """Puts the latent browser, the generator's image and the reference side by side.

    Without a model the reference has the row to itself. The browser takes the generator's
    place. Edges between the images can be dragged.

    Parameters
    ----------
    browser, generator, reference : QWidget
    """

    imagesShown = Signal(bool, bool)
    """Emitted with whether the generator's image is in sight, and the reference."""
    wanted = Signal(str)
    """Emitted with the new choice of images."""

    def __init__(self, browser: QWidget, generator: QWidget, reference: QWidget) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self._browser, self._generator, self._reference = browser, generator, reference
        self._shown: Shown = "both"
        self._has_model = self._browsing = False
        self.setHandleWidth(12)
        self.setChildrenCollapsible(False)
        for widget, stretch in ((browser, 2), (generator, 1), (reference, 1)):
            self.addWidget(widget)
            self.setStretchFactor(self.count() - 1, stretch)
        self._update()

    @property
    def shown(self) -> Shown:
        """Images that the user wants to see."""
        return self._shown

    @property
    def is_swapped(self) -> bool:
        """Whether the reference is on the left."""
        return self.indexOf(self._reference) == 0

    @property
    def is_reference_alone(self) -> bool:
        """Whether nothing stands beside the reference."""
        return self._browser.isHidden() and self._generator.isHidden()

    def show_images(self, shown: Shown) -> None:
        """Show both images, or one of them alone."""
        self._shown = shown
        self._update()
        self.wanted.emit(shown)

    def set_model(self, has_model: bool) -> None:
        """Say whether there is a generator whose image could be shown."""
        if has_model != self._has_model:
            self._has_model = has_model
            self._update()

    def set_browsing(self, browsing: bool) -> None:
        """Show the latent browser in the generator's place, or the generator again."""
        if browsing != self._browsing:
            self._browsing = browsing
            self._update()

    def swap(self) -> None:
        """Put the reference on the other side."""
        self.insertWidget(2 if self.is_swapped else 0, self._reference)

    def _update(self) -> None:
        generator = self._has_model and not self._browsing and self._shown != "reference"
        # One image is always there.
        alone = self._shown == "generator" and generator
        self._browser.setVisible(self._browsing)
        self._generator.setVisible(generator)
        self._reference.setVisible(not alone)
        self.imagesShown.emit(generator, not alone)
