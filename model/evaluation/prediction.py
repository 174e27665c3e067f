"""Time and error of a picture at a setting, predicted from a few of its tiles."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from model.errors import RenderError
from model.rendering.raster import TIME_GROWTH, Raster
from model.rendering.setting import Setting, SettingRenderer
from model.scene.inputs import SceneInputs
from model.scene.scene import Lighting

TILE = 8
"""Width and height of a tile, in pixels."""

TILES = 64
"""Tiles that are drawn, where a picture has more."""

REPEATS = 3
"""Drawings of what is timed; the fastest counts."""

EVEN = 0.1
"""Share of the tiles that lie anywhere, however little there is to be seen."""

COARSE = 3 / 8
"""Columns of the picture by which times are predicted, and places chosen, for each one shown."""


@dataclass(frozen=True)
class Prediction:
    """Expected time and error of a picture at a setting.

    Attributes
    ----------
    seconds : float
        To draw it.
    rmse : float
        Distance from the exact picture under the same light, see :mod:`model.metrics`.
    """

    setting: Setting
    seconds: float
    rmse: float


class Predictor:
    """Predicts pictures of one scene from a coarse one, and from tiles where there is something.

    Times follow from a picture of fewer pixels. Errors are those of tiles, as interpolated pixels
    are nearer to the truth the more there are: more tiles lie where the coarse picture has edges,
    and count less.

    Parameters
    ----------
    renderer : SettingRenderer
    lighting : {"none", "direct", "soft", "shadows", "path"}
        Of that renderer.
    inputs : SceneInputs
    shown : Raster
        Pixels of the whole picture.
    """

    def __init__(
        self, renderer: SettingRenderer, lighting: Lighting, inputs: SceneInputs, shown: Raster
    ) -> None:
        self._renderer, self._inputs, self._shown = renderer, inputs, shown
        self._coarse = shown.scaled(COARSE)
        cells = list(shown.tiles(TILE, TILE))
        seen, _seconds = renderer.draw(Setting(), inputs, self._coarse)
        self._tiles, self._weights = chosen_tiles(cells, _edges(seen[..., :3], cells))
        exact = Setting.exact(lighting)
        self._times: dict[Setting, tuple[float, float]] = {}
        self._truth = [renderer.draw(exact, inputs, tile)[0] for tile in self._tiles]

    def predict(self, setting: Setting) -> Prediction:
        """Predict the whole picture at a setting."""
        squares = [
            np.mean((self._renderer.draw(setting, self._inputs, tile)[0] - truth)[..., :3] ** 2)
            for tile, truth in zip(self._tiles, self._truth, strict=True)
        ]
        rmse = math.sqrt(float(self._weights @ np.array(squares)))
        return Prediction(setting, self._seconds(setting), rmse)

    def _seconds(self, setting: Setting) -> float:
        """Predict the time by a picture of the least number of pixels and a coarse one."""
        # Settings that differ in their pixels only have the same.
        full = replace(setting, pixels=1.0)
        if full not in self._times:
            least = replace(self._shown, left=0, top=0, columns=1, rows=1)
            self._times[full] = self._fastest(full, least), self._fastest(full, self._coarse)
        call, coarse = self._times[full]
        whole = setting.raster(self._shown)
        share = whole.rows * whole.columns / (self._coarse.rows * self._coarse.columns)
        return call + max(coarse - call, 0.0) * share**TIME_GROWTH

    def _fastest(self, setting: Setting, raster: Raster) -> float:
        drawn = (self._renderer.draw(setting, self._inputs, raster) for _ in range(REPEATS))
        return min(seconds for _rgba, seconds in drawn)


def chosen_tiles(
    cells: Sequence[Raster], interest: NDArray[np.float64]
) -> tuple[list[Raster], NDArray[np.float64]]:
    """Choose tiles, more of them where there is more of interest, evenly among their kind.

    Returns
    -------
    tiles : list of Raster
        At most :data:`TILES`; one that was chosen several times counts so often.
    weights : ndarray of float64, shape (n,)
        By which a mean over all cells follows from the tiles' numbers.
    """
    pixels = np.array([cell.rows * cell.columns for cell in cells], dtype=np.float64)
    if len(cells) <= TILES:
        return list(cells), pixels / pixels.sum()
    total = (interest * pixels).sum()
    share = pixels / pixels.sum()
    if total > 0:
        share = EVEN * share + (1 - EVEN) * interest * pixels / total
    places = (np.arange(TILES) + 0.5) / TILES
    drawn = np.minimum(np.searchsorted(np.cumsum(share), places), len(cells) - 1)
    indices, counts = np.unique(drawn, return_counts=True)
    weights = pixels[indices] / pixels.sum() / share[indices] * counts / TILES
    return [cells[index] for index in indices], weights


def _edges(image: NDArray[np.float32], cells: Sequence[Raster]) -> NDArray[np.float64]:
    """Return the largest difference of a coarse picture's channels within each cell of it."""
    rows, columns = image.shape[:2]
    found = []
    for cell in cells:
        top, bottom = cell.top * rows // cell.height, -(-cell.bottom * rows // cell.height)
        left, right = cell.left * columns // cell.width, -(-cell.right * columns // cell.width)
        part = image[max(top - 1, 0) : bottom + 1, max(left - 1, 0) : right + 1]
        found.append(float((part.max((0, 1)) - part.min((0, 1))).max()))
    return np.array(found)


def chosen_setting(
    renderer: SettingRenderer,
    lighting: Lighting,
    scenes: Sequence[SceneInputs],
    shown: Raster,
    settings: Iterable[Setting],
    seconds: float | None,
    error: float | None,
) -> Prediction:
    """Return the setting at which pictures of some scenes keep to a time and an error.

    Parameters
    ----------
    renderer, lighting, shown
        See :class:`Predictor`.
    seconds, error
        Of a picture in the mean; see :func:`chosen`.
    """
    predictors = [Predictor(renderer, lighting, inputs, shown) for inputs in scenes]
    means = []
    for setting in settings:
        found = [predictor.predict(setting) for predictor in predictors]
        mean = float(np.mean([each.seconds for each in found]))
        square = float(np.mean([each.rmse**2 for each in found]))
        means.append(Prediction(setting, mean, math.sqrt(square)))
    return chosen(means, seconds, error)


def chosen(
    predictions: Iterable[Prediction], seconds: float | None, error: float | None
) -> Prediction:
    """Return the nearest picture that takes no longer; without a time, the fastest that is near.

    Parameters
    ----------
    seconds : float or None
        That a picture may take.
    error : float or None
        RMSE that it may have at most.

    Raises
    ------
    RenderError
        When no picture keeps to both; it says what the nearest to that would be.
    """
    by_time = sorted(predictions, key=lambda each: each.seconds)
    near = [each for each in by_time if error is None or each.rmse <= error]
    if not near:
        best = min(by_time, key=lambda each: each.rmse)
        raise RenderError(
            f"No setting comes to an error of {error:g} here; the nearest has one of about "
            f"{best.rmse:.2g}, in {_time(best.seconds)}."
        )
    if seconds is None:
        return near[0]
    quick = [each for each in near if each.seconds <= seconds]
    if quick:
        return min(quick, key=lambda each: each.rmse)
    if error is None:
        raise RenderError(
            f"{_time(seconds)} is too little for this picture on this machine: the fastest takes "
            f"about {_time(by_time[0].seconds)}, with an error of {by_time[0].rmse:.2g}."
        )
    raise RenderError(
        f"An error of {error:g} takes about {_time(near[0].seconds)} here; allow that, or a "
        "larger error."
    )


def _time(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"
