"""``render``: an image, a picture or a movie of a full turn, to a file."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from app.cli import options, values
from app.cli.options import option
from model.errors import RenderError
from model.networks.names import DeviceChoice
from model.rendering.raster import Raster
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.scene import LightDirection, Lighting, RendererName
from model.scene.transfer_function import OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource

if TYPE_CHECKING:
    from app.state.session import Session

Background = tuple[int, int, int]  # red, green and blue, each 0..255


@dataclass(frozen=True, kw_only=True)
class Render:
    """Render one image, or a movie of a full turn, to a file."""

    out: Path = options.output(
        "OUT.png, OUT.mp4 or OUT.gif: a full turn about the up axis, or OUT.npy: float32 RGBA "
        "(H, W, 4).",
        *(".png", ".mp4", ".gif", ".npy"),
        metavar="OUT",
    )
    renderer: Literal[RendererName, "generator"] = option(
        "The reference, the fast ray caster, or the model.", default="vtk"
    )
    source: VolumeSource = options.volume()
    model: Path | None = options.model()
    session: Path | None = option(
        "A session that 'File > Save session' wrote. Its volume, view, TF, light, crop box and "
        "mask are used unless other options are given.",
        metavar="NAME.tfscope",
    )
    view: View | None = options.view(
        default=None,
        help=f"{options.VIEW_HELP} (default: the session's, or 30,20,0,1)",
        show_default=False,
    )
    tf: Path | None = options.tf()
    lighting: Lighting | None = option(
        "Light of VTK's and the ray caster's images. (default: the model's, or none)"
    )
    light: LightDirection | None = options.light()
    crop: CropBox | None = options.crop()
    mask: Path | None = option(
        "Labels, as 'File > Save mask' writes them: only voxels of labels other than 0 are drawn. "
        "Those of another grid are resampled.",
        metavar="MASK",
    )
    labels: str = option(
        "Which labels of the mask are drawn, by numbers or names. (default: all)",
        default="",
        metavar="LABEL,...",
        show_default=False,
    )
    clip: ClipPlane | None = options.clip()
    samples: int | None = option(
        "Samples per pixel in path-traced light: four times as many halve the noise. (default: 64; "
        "with --error as many as it takes)",
        min=1,
        max=1 << 20,
    )
    error: float | None = option(
        "Stop path tracing at this estimated error (RMSE), or else at --samples.", min=1e-4, max=1.0
    )
    denoise: bool | None = option(
        "Clean path-traced pictures by Intel's Open Image Denoise while that lowers their error. "
        "(default: where it is installed)",
        flag="--denoise/--no-denoise",
    )
    size: Raster | None = option(
        "Pixels. (default: the model's, or 256)", metavar="N or WxH", parser=values.pixels
    )
    background: Background | None = option(
        "Background of a picture or movie: black, white, transparent or #rrggbb.",
        default="black",
        metavar="COLOUR",
        parser=values.background,
    )
    legend: bool = option("Paint the colour legend into a picture or movie.", default=False)
    scale_bar: bool = option(
        "Paint a scale bar. Its length holds in the plane through the middle of what is shown.",
        default=False,
    )
    seconds: float = option("Length of a movie.", default=8.0, min=0.5, max=600)
    rate: int = option("Pictures a second of a movie.", default=25, min=1, max=60)
    brightness: float | None = option(
        "Brightness of a PNG, as in the window. (default: 1; lit images, which are dim, 2)",
        min=0.25,
        max=32.0,
    )
    draw_missing: bool = option(
        "Draw voxels of which the file says that nothing was measured there.", default=False
    )
    interpolate: bool | None = options.interpolate()
    sample_distance: float | None = option(
        "Distance of samples on a ray. At .1 the ray caster shows no rings on thin layers, as in "
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
        options.late("drawing").render_to_file(asked)

    @property
    def is_array(self) -> bool:
        """Whether numbers are written, not a picture."""
        return self.out.suffix.lower() == ".npy"

    @property
    def is_movie(self) -> bool:
        """Whether a full turn is written."""
        return self.out.suffix.lower() in (".mp4", ".gif")

    def inputs(self, tf: TransferFunction, volume: Volume | None = None) -> SceneInputs:
        """Return the inputs of the image of a volume under a TF."""
        view = self.view or values.HOME_VIEW
        others = {"light": self.light, "crop": self.crop, "clip": self.clip}
        mask = None if volume is None else self._mask_of(volume, tf.opacity)
        return SceneInputs.of(view, tf, mask=mask, interpolates=self.interpolate, **others)

    def _mask_of(self, volume: Volume, opacity: OpacityTF) -> Mask | None:
        from app.cli.console import warn
        from model.rendering.pieces import mask_of
        from model.volume_files.masks import read_labels

        if self.mask is None:
            if self.labels:
                raise RenderError("Labels are those of a mask; give its file.", mask="FILE")
            return None
        found = read_labels(self.mask, volume)
        if found.note:
            warn(found.note)
        chosen = found.named_by(self.labels) if self.labels else found.values
        return mask_of(found, chosen, volume, opacity)

    def _of_session(self, path: Path) -> Render:
        """Take missing options from a session: volume, view, TF, light, crop, mask, legend."""
        from app.cli.console import warn
        from app.state.session import Session, kept_mask

        if self.source.is_placed:
            raise RenderError(
                "A session has its own range and scale; leave --range and --scale out."
            )
        session = Session.load(path)
        memory, settings = session.content.memory, session.content.settings
        if session.wrong:
            names = ", ".join(f"'{name}'" for name in session.wrong)
            warn(f"{path}: its {names} could not be read.")
        mask = self.mask or kept_mask(path, memory)
        if memory.mask and mask is None:
            warn(f"{path}: its mask is not in the figure, so all voxels are drawn.")
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
            mask=mask,
            clip=self.clip or memory.clip,
            interpolate=memory.interpolates if self.interpolate is None else self.interpolate,
            brightness=self.brightness or memory.brightness,
            draw_missing=self.draw_missing or memory.draws_missing,
            legend=self.legend or (settings.legend and not self.is_array),
            scale_bar=self.scale_bar or (settings.scale_bar and not self.is_array),
        )


def _session_source(given: VolumeSource, session: Session, path: Path) -> VolumeSource:
    from model.volume_files.choice import Choice

    if given.path is None and not session.volume.exists():
        raise RenderError(
            f"{path} shows {session.volume}, which no longer exists; give its new place.",
            volume="FILE",
        )
    memory = session.content.memory
    choice = Choice.parse(memory.choice)
    kept = {name: getattr(given, name) or chosen for name, chosen in vars(choice).items()}
    raw = given.raw or memory.raw_layout or None
    return replace(given, path=given.path or session.volume, raw=raw, **kept)
