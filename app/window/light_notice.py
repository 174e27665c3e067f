"""Says over the images that they are drawn without light, or in another one than last time."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import QObject

from app.controls import Action
from app.state.known_volume import FORMER_TOLD
from app.state.reference_choices import ReferenceChoices
from app.state.reference_work import ReferenceWork
from app.window.notices import Notices

KEY = "light"


class LightNotice(QObject):
    """Follows the light that the window chooses by itself."""

    def __init__(self, work: ReferenceWork, notices: Notices) -> None:
        super().__init__(notices)
        self._work = work
        self._notices = notices
        work.lightWentOut.connect(self._tell)
        work.lightReplaced.connect(partial(notices.tell, FORMER_TOLD))
        work.choicesChanged.connect(self._follow)
        work.volumeStarted.connect(partial(notices.clear, KEY))

    def _tell(self, seconds: float) -> None:
        self._notices.tell(
            f"Drawn without light, with which an image takes {seconds:.1f} s here.",
            Action("Light it", partial(self._work.choose, lighting="direct")),
            key=KEY,
        )

    def _follow(self, choices: ReferenceChoices) -> None:
        if choices.lighting != "auto":
            self._notices.clear(KEY)
