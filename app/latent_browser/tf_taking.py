"""TFs of the map that become the present one."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject, Signal

from app.state.brightness import Brightness
from app.state.latent_state import Place
from app.state.latent_work import LatentWork
from app.state.viewer_state import ViewerState
from model.scene.tf_fitting import fitted_curve, fitted_modes, tf_difference
from model.scene.transfer_function import OpacityTF

SAME_TF = 0.02
"""Difference in opacity (RMS) up to which a fitted TF stands at the place it was found."""


class TFTaking(QObject):
    """Makes opacity TFs of the map the present one, each as one edit that can be undone."""

    news = Signal(str)
    """Emitted with a sentence for the status bar."""

    def __init__(
        self, state: ViewerState, work: LatentWork, brightness: Brightness, parent: QObject
    ) -> None:
        super().__init__(parent)
        self._state, self._work, self._brightness = state, work, brightness

    def take(
        self, tf: OpacityTF, text: str, place: Place | None, exposure: float | None = None
    ) -> None:
        """Make an opacity TF the present one.

        Parameters
        ----------
        text : str
            Name of the edit in the menu.
        place : tuple of float, or None
            Where it was found.
        exposure : float or None
            Factor by which its picture is brighter than usual, which the image becomes, too.
        """
        if tf.scalar_range != self._state.scalar_range:
            # Asked for while another volume was opened.
            return
        as_modes = self._work.state.choices.as_modes
        # A TF of the map has many samples.
        fitted = fitted_modes(tf) if as_modes else fitted_curve(tf)
        difference = tf_difference(fitted, tf)
        if place is not None and difference < SAME_TF:
            self._work.session.remember_place(fitted, place)
        with self._state.edits.as_one(text):
            self._state.tf_input.set(replace(self._state.transfer_function, opacity=fitted), text)
            if exposure is not None:
                self._brightness.expose(exposure)
        what = f"{len(fitted.modes)} modes" if as_modes else f"{len(fitted.points)} points"
        self.news.emit(f"The TF has {what}; {difference:.3f} from the map's (RMS).")
