"""Distances of answers while something moves from those at rest: curves, fields, pictures."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from app.engines.quality import Quality
from app.engines.requests import Request
from app.state.sensitivity_answers import Source
from model.sensitivity.cosine import cosine

Kind = Literal["curve", "field", "map"]
"""A region's sensitivities, a field of a value, or pictures of the map of TFs."""


@dataclass(frozen=True)
class LiveError:
    """Time of the last answer while something moved, and its distance from that at rest.

    Attributes
    ----------
    seconds : float
    cosine : float or None
        Of sensitivities, to those at rest; 1 where they have one shape.
    error : float or None
        Of pictures, root mean square of the colours' differences from those at rest, 0 to 1.
    """

    seconds: float
    cosine: float | None = None
    error: float | None = None


class LiveErrors(QObject):
    """Compares answers at rest with the last ones while something moved, if both were asked alike.

    Attributes
    ----------
    found : dict
        The newest comparison of each kind.
    """

    changed = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.found: dict[Kind, LiveError] = {}
        self._live: dict[Kind, tuple[Request, NDArray[np.float32], float]] = {}

    def forget(self) -> None:
        """Begin anew: another volume or light is drawn."""
        self._live.clear()
        self.found.clear()
        self.changed.emit()

    def take(
        self,
        kind: Kind,
        asker: Source,
        request: Request,
        value: NDArray[np.float32],
        seconds: float,
    ) -> None:
        """Take an answer.

        Parameters
        ----------
        asker : {"exact", "stand-in", "learned"}
            Who answered. All live answers are compared with those of a renderer at rest.
        value : ndarray of float32
            A curve (n,), a field (H, W, 3), or pictures (n, H, W, 4).
        """
        question = _question(request)
        if request.quality.live:
            self._live[kind] = question, value, seconds
            return
        if asker == "learned":
            # It answers at rest as it does live.
            return
        last = self._live.pop(kind, None)
        if last is None or last[0] != question:
            return
        coarse, taken = _as_large(last[1], value), last[2]
        if kind == "map":
            gap = (coarse - value)[..., :3]
            found = LiveError(taken, error=float(np.sqrt(np.mean(gap**2))))
        else:
            found = LiveError(taken, cosine=cosine(coarse.ravel(), value.ravel()))
        self.found[kind] = found
        self.changed.emit()


def _question(request: Request) -> Request:
    """Return a request's question, whatever its quality."""
    return replace(request, quality=Quality(1))


def _as_large(coarse: NDArray[np.float32], fine: NDArray[np.float32]) -> NDArray[np.float32]:
    """Interpolate pictures or fields to as many pixels as others have."""
    if coarse.shape == fine.shape:
        return coarse
    # Late: it is needed at rest only, and brings the renderers.
    from model.rendering.resizing import resized

    shape = fine.shape[-3:-1]
    if coarse.ndim == 3:
        return resized(coarse, shape)
    return np.stack([resized(each, shape) for each in coarse])
