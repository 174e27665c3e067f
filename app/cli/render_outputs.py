"""The files of ``render``: arrays, pictures, and movies of a full turn."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from app.cli.console import counting
from app.cli.fonts import fonts
from app.cli.outputs import make_room_for
from app.cli.render_order import Drawer, RenderOrder
from model.errors import RenderError, reason
from model.files import writing
from model.rendering.brightness import usual_brightness
from model.rendering.movie_file import write_movie
from model.rendering.scale_bar import DEPTH_TEXT, Scale
from model.scene.axes import DEFAULT_UP
from model.scene.thinned_volume import ThinnedVolume
from model.scene.transfer_function import OpacityTF
from model.scene.turntable import turntable
from model.scene.view import View
from model.scene.volume import Volume

if TYPE_CHECKING:
    from PySide6.QtGui import QImage


def write_array(out: Path, rgba: NDArray[np.float32]) -> None:
    """Write an image as an array."""
    make_room_for(out)
    try:
        # An open file, as numpy appends a suffix to names in capitals.
        with writing(out) as file:
            np.save(file, rgba)
    except OSError as error:
        raise RenderError(f"{out}: the image cannot be written ({reason(error)}).") from error


def write_figure(order: RenderOrder, drawer: Drawer) -> None:
    """Write a picture that says in itself what it shows."""
    from app.figures.picture import save_image, software

    image = _figure(order, drawer, drawer.draw(order.view), order.view)
    facts, brightness = drawer.facts(), _brightness(order, drawer)
    if brightness != 1:
        facts["Brightness"] = f"{brightness:g}"
    if order.scale_bar:
        facts["Scale bar"] = f"Holds {DEPTH_TEXT}"
    for keyword, text in {**facts, "Software": software()}.items():
        image.setText(keyword, text)
    make_room_for(order.out)
    save_image(order.out, image)


def write_turntable(order: RenderOrder, drawer: Drawer) -> None:
    """Write a full turn about the volume's up axis as a movie."""
    from app.window.figure import pixels_of

    count = max(round(order.seconds * order.rate), 2)
    volume = _volume_of(drawer)
    middle = tuple((_shown(drawer).min(axis=0) + _shown(drawer).max(axis=0)) / 2)
    up = order.up or volume.up or DEFAULT_UP
    views = turntable(order.view, count, up, volume.proportions, middle)
    with counting("Drawing pictures", count) as (progress, task):

        def frames() -> Iterator[NDArray[np.uint8]]:
            for view in views:
                yield pixels_of(_figure(order, drawer, drawer.draw(view), view))
                progress.advance(task)

        make_room_for(order.out)
        write_movie(order.out, frames(), order.rate)


def _figure(order: RenderOrder, drawer: Drawer, rgba: NDArray[np.float32], view: View) -> QImage:
    from app.window.figure import FigureLook, Subject, figure

    if order.legend or order.scale_bar:
        fonts()
    raster = drawer.raster
    look = FigureLook(raster.width, raster.height, order.background, order.legend, order.scale_bar)
    scale, units = None, ""
    if drawer.volume is not None:
        units = drawer.volume.units
    if order.scale_bar:
        scale = Scale.of(_volume_of(drawer), _shown(drawer))
    images = {"reference": (rgba, _brightness(order, drawer))}
    inputs = replace(drawer.inputs, view=view)
    return figure(look, images, "reference", inputs, Subject(units, scale))


def _brightness(order: RenderOrder, drawer: Drawer) -> float:
    return usual_brightness(drawer.lighting) if order.brightness is None else order.brightness


def _volume_of(drawer: Drawer) -> Volume:
    if drawer.volume is None:
        raise RenderError(
            "The model does not know its volume's lengths, for a scale bar or a turntable; "
            "give --volume."
        )
    return drawer.volume


def _shown(drawer: Drawer) -> NDArray[np.float64]:
    """Places around what the TF shows, as fractions of the volume's lengths."""
    return _shown_points(_volume_of(drawer), drawer.inputs.opacity_tf)


@lru_cache(maxsize=1)
def _shown_points(volume: Volume, opacity: OpacityTF) -> NDArray[np.float64]:
    return ThinnedVolume.of(volume).shown_points(opacity)
