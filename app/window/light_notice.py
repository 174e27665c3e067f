"""Says over the image that it is drawn without light, and offers it."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject

from app.controls import Action
from app.image_view.banner import Banner
from app.image_view.engine_pane import EnginePane
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork


class LightNotice(QObject):
    """Follows the light that the window chooses by itself.

    Parameters
    ----------
    pane : EnginePane
        The reference's.
    work : ReferenceWork

    Attributes
    ----------
    banner : Banner
    """

    def __init__(self, pane: EnginePane, work: ReferenceWork) -> None:
        super().__init__(pane)
        self._work = work
        self.banner = Banner(pane.canvas)
        work.lightWentOut.connect(self._tell)
        work.choicesChanged.connect(self._follow)
        work.volumeStarted.connect(self.banner.hide)

    def _tell(self, seconds: float) -> None:
        self.banner.show_text(
            f"Drawn without light, with which an image takes {seconds:.1f} s here.",
            Action("Light it", partial(self._work.choose, lighting="direct")),
            Action("Leave it", self.banner.hide),
        )

    def _follow(self, choices: ReferenceChoices) -> None:
        if choices.lighting != "auto":
            self.banner.hide()
