"""``render``: an image, a picture or a movie of a full turn, to a file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from app.cli import options, values
from model.errors import RenderError, reason
from model.files import writing
from model.networks.names import DeviceChoice
from model.rendering.raster import Raster
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting, RendererName
from model.scene.transfer_function import OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource

if TYPE_CHECKING:
    from PySide6.QtGui import QImage

    from app.cli.drawers import Drawer
    from app.state.session import Session

Background = tuple[int, int, int]
"""Red, green and blue, each 0..255."""


@dataclass(frozen=True, kw_only=True)
class Render:
    """Render one image, or a movie of a full turn, to a file."""

    out: Path = options.output(
        "OUT.png, OUT.mp4 or OUT.gif: a full turn about the up axis, or OUT.npy: float32 RGBA "
        "(H, W, 4).",
        *(".png", ".mp4", ".gif", ".npy"),
        metavar="OUT",
    )
    renderer: Literal[RendererName, "generator"] = options.option(
        "vtk", "The reference, the fast ray caster, or the model."
    )
    source: VolumeSource = options.volume()
    model: Path | None = options.model()
    session: Path | None = options.option(
        None,
        "What 'File > Save session' wrote: its volume, view, TF, light and crop box, unless other "
        "options say so.",
        metavar="NAME.tfscope",
    )
    view: View | None = options.view(
        default=None,
        help=f"{options.VIEW_HELP} (default: the session's, or 30,20,0,1)",
        show_default=False,
    )
    tf: Path | None = options.tf()
    lighting: Lighting | None = options.option(
        None, "For VTK and ray caster. (default: the model's, or none)"
    )
    light: LightDirection | None = options.light()
    crop: CropBox | None = options.crop()
    samples: int | None = options.option(
        None,
        "Of each pixel in path-traced light: four times as many halve the noise. (default: 64; "
        "with --error as many as it takes)",
        min=1,
        max=1 << 20,
    )
    error: float | None = options.option(
        None,
        "Estimated error (RMSE) of path-traced light that is good enough: as many samples as it "
        "takes, at most --samples.",
        min=1e-4,
        max=1.0,
    )
    denoise: bool | None = options.option(
        None,
        "Whether Intel's Open Image Denoise cleans path-traced pictures as long as that brings "
        "them nearer to the truth. (default: where it is installed)",
        flag="--denoise/--no-denoise",
    )
    size: Raster | None = options.option(
        None,
        "Pixels. (default: the model's, or 256)",
        metavar="N or WxH",
        parser=values.pixels,
    )
    background: Background | None = options.option(
        "black",
        "Of a picture or movie: black, white, transparent or #rrggbb.",
        metavar="COLOUR",
        parser=values.background,
    )
    legend: bool = options.option(False, "Paint the colour legend into a picture or movie.")
    scale_bar: bool = options.option(
        False,
        "Paint a scale bar. Its length holds in the plane through the middle of what is shown.",
    )
    seconds: float = options.option(8.0, "Length of a movie.", min=0.5, max=600)
    rate: int = options.option(25, "Pictures a second of a movie.", min=1, max=60)
    brightness: float | None = options.option(
        None,
        "Of a PNG, as in the window. (default: 1; lit images, which are dim, 2)",
        min=0.25,
        max=32.0,
    )
    draw_missing: bool = options.option(
        False, "Draw voxels of which the file says that nothing was measured there."
    )
    sample_distance: float | None = options.option(
        None,
        "Between samples along a ray. At .1 the ray caster shows no rings on thin layers, as in "
        "the window. (default: .5, or the model's)",
        metavar="VOXELS",
        min=0.01,
        max=10.0,
    )
    device: DeviceChoice = options.device()
    # Of a session: its TF, the checksum of its voxels, and the axis that a movie turns about.
    known_tf: TransferFunction | None = None
    fingerprint: str = ""
    up: str = ""

    def run(self) -> None:
        """Render the image and write it, replacing an existing file."""
        asked = self if self.session is None else self._of_session(self.session)
        asked._write()

    @property
    def is_array(self) -> bool:
        """Whether numbers are written, and no picture."""
        return self.out.suffix.lower() == ".npy"

    @property
    def is_movie(self) -> bool:
        """Whether a full turn is written."""
        return self.out.suffix.lower() in (".mp4", ".gif")

    def inputs(self, tf: TransferFunction) -> SceneInputs:
        """Return the inputs of the image under a TF."""
        view = self.view or values.HOME_VIEW
        return SceneInputs.of(view, tf, light=self.light, crop=self.crop)

    def _write(self) -> None:
        if self.light is not None and self.lighting == "none":
            raise RenderError("An unlit image has no light to be moved.", lighting="direct")
        if self.is_array and (self.legend or self.scale_bar):
            raise RenderError(f"{self.out}: an array has no legend or scale bar; choose .png.")
        if self.is_movie and self.background is None:
            raise RenderError("A movie has no transparent background; choose a colour.")
        from app.cli.drawers import open_drawer
        from app.cli.outputs import make_room_for

        drawer = open_drawer(self)
        try:
            if self.is_array:
                image = drawer.draw(drawer.inputs.view)
                make_room_for(self.out)
                _write_array(self.out, image)
            elif self.is_movie:
                _write_turntable(self, drawer)
            else:
                _write_picture(self, drawer)
            if self.error is not None:
                print(f"{self.out}: by {drawer.drawn_by()}.")
        finally:
            drawer.close()

    def _of_session(self, path: Path) -> Render:
        """Fill in what was left out from a session: volume, view, TF, light, crop box, legend."""
        from app.cli.console import warn
        from app.state.session import Session

        if self.source.is_placed:
            raise RenderError(
                "A session has its own range and scale; leave --range and --scale out."
            )
        session = Session.load(path)
        memory, settings = session.content.memory, session.content.settings
        if session.wrong:
            names = ", ".join(f"'{name}'" for name in session.wrong)
            warn(f"{path}: its {names} could not be read.")
        lighting = self.lighting
        if lighting is None and memory.lighting != "auto":
            lighting = memory.lighting
        is_lit = lighting not in (None, "none")
        is_model = self.renderer == "generator"
        return replace(
            self,
            source=_session_source(self.source, session, path),
            model=self.model or (session.model if is_model else None),
            view=self.view or memory.view,
            known_tf=None if self.tf else memory.tf,
            fingerprint=session.fingerprint,
            up=memory.up_axis,
            lighting=None if is_model else lighting,
            light=self.light or (memory.light if is_lit else None),
            crop=self.crop or memory.crop,
            brightness=self.brightness or memory.brightness,
            draw_missing=self.draw_missing or memory.draws_missing,
            legend=self.legend or (settings.legend and not self.is_array),
            scale_bar=self.scale_bar or (settings.scale_bar and not self.is_array),
        )


def _session_source(given: VolumeSource, session: Session, path: Path) -> VolumeSource:
    from model.volume_files.choice import Choice

    if given.path is None and not session.volume.exists():
        raise RenderError(
            f"{path} shows {session.volume}, which is not there any more; give its new place.",
            volume="FILE",
        )
    memory = session.content.memory
    choice = Choice.parse(memory.choice)
    kept = {name: getattr(given, name) or chosen for name, chosen in vars(choice).items()}
    raw = given.raw or memory.raw_layout or None
    return replace(given, path=given.path or session.volume, raw=raw, **kept)


def _write_array(out: Path, rgba: NDArray[np.float32]) -> None:
    try:
        # An open file, as numpy appends a suffix to names in capitals.
        with writing(out) as file:
            np.save(file, rgba)
    except OSError as error:
        raise RenderError(f"{out}: the image cannot be written ({reason(error)}).") from error


def _write_picture(asked: Render, drawer: Drawer) -> None:
    """Write a picture whose texts say what it shows."""
    from app.cli.outputs import make_room_for
    from app.figures.picture import save_image, software
    from model.rendering.scale_bar import DEPTH_TEXT

    image = _figure(asked, drawer, drawer.inputs.view)
    facts, brightness = drawer.facts(), _brightness(asked, drawer)
    if brightness != 1:
        facts["Brightness"] = f"{brightness:g}"
    if asked.scale_bar:
        facts["Scale bar"] = f"Holds {DEPTH_TEXT}"
    for keyword, text in {**facts, "Software": software()}.items():
        image.setText(keyword, text)
    make_room_for(asked.out)
    save_image(asked.out, image)


def _write_turntable(asked: Render, drawer: Drawer) -> None:
    """Write a full turn about the volume's up axis as a movie."""
    from app.cli.console import counting
    from app.cli.outputs import make_room_for
    from app.window.figure import pixels_of
    from model.rendering.movie_file import write_movie
    from model.scene.axes import DEFAULT_UP
    from model.scene.turntable import turntable

    count = max(round(asked.seconds * asked.rate), 2)
    volume, shown = drawer.known_volume, _shown(drawer)
    middle = tuple((shown.min(axis=0) + shown.max(axis=0)) / 2)
    up = asked.up or volume.up or DEFAULT_UP
    views = turntable(drawer.inputs.view, count, up, volume.proportions, middle)
    with counting("Drawing pictures", count) as show:

        def frames() -> Iterator[NDArray[np.uint8]]:
            for number, view in enumerate(views, 1):
                yield pixels_of(_figure(asked, drawer, view))
                show(number)

        make_room_for(asked.out)
        write_movie(asked.out, frames(), asked.rate)


def _figure(asked: Render, drawer: Drawer, view: View) -> QImage:
    from app.cli.captions import fonts
    from app.window.figure import FigureLook, Subject, figure
    from model.rendering.scale_bar import Scale

    rgba = drawer.draw(view)
    if asked.legend or asked.scale_bar:
        fonts()
    raster = drawer.raster
    look = FigureLook(raster.width, raster.height, asked.background, asked.legend, asked.scale_bar)
    units = "" if drawer.volume is None else drawer.volume.units
    scale = Scale.of(drawer.known_volume, _shown(drawer)) if asked.scale_bar else None
    images = {"reference": (rgba, _brightness(asked, drawer))}
    inputs = replace(drawer.inputs, view=view)
    return figure(look, images, "reference", inputs, Subject(units, scale))


def _brightness(asked: Render, drawer: Drawer) -> float:
    from model.rendering.brightness import usual_brightness

    return usual_brightness(drawer.lighting) if asked.brightness is None else asked.brightness


def _shown(drawer: Drawer) -> NDArray[np.float64]:
    """Places around what the TF shows, as fractions of the volume's lengths."""
    return _shown_points(drawer.known_volume, drawer.inputs.opacity_tf)


@lru_cache(maxsize=1)
def _shown_points(volume: Volume, opacity: OpacityTF) -> NDArray[np.float64]:
    from model.scene.thinned_volume import ThinnedVolume

    return ThinnedVolume.of(volume).shown_points(opacity)
