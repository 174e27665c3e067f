"""The order of ``render``: images asked for, and the renderer that draws them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.cli.captions import range_text, view_text
from app.cli.look import Look
from model.rendering.raster import Raster
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource

Background = tuple[int, int, int]
"""Red, green and blue, each 0..255."""


@dataclass(frozen=True, kw_only=True)
class RenderOrder(Look):
    """Options of the ``render`` command; see :func:`app.cli.image_commands.render`.

    Attributes
    ----------
    known_tf : TransferFunction or None
        Over its own range and scale, in place of a file's; a session's.
    fingerprint : str
        Checksum of the voxels that are expected; empty for any.
    up : str
        Axis that a movie turns about, such as "+z"; empty for the volume's own.
    """

    renderer: str
    volume: VolumeSource
    model: Path | None
    tf: Path | None
    lighting: Lighting | None
    samples: int | None
    error: float | None
    denoise: bool | None
    size: Raster | None
    brightness: float | None
    draws_missing: bool
    sample_distance: float | None
    device: str
    out: Path
    background: Background | None = (0, 0, 0)
    legend: bool = False
    scale_bar: bool = False
    seconds: float = 8.0
    rate: int = 25
    known_tf: TransferFunction | None = None
    fingerprint: str = ""
    up: str = ""

    @property
    def is_array(self) -> bool:
        """Whether numbers are written, and no picture."""
        return self.out.suffix.lower() == ".npy"

    @property
    def paths_are_asked_for(self) -> bool:
        """Whether there is an option of path-traced light."""
        return (self.samples, self.denoise, self.error) != (None, None, None)


@dataclass(frozen=True, eq=False)
class Drawer:
    """A renderer with what its images show.

    Attributes
    ----------
    draw : callable
        Returns the image of a view: float32 (H, W, 4).
    volume : Volume or None
        None where a generator draws of which only the scene is known.
    lighting : {"none", "direct", "soft", "path"}
    light : LightDirection or None
        None where it is unlit.
    drawn_by : callable
        Returns who has drawn the last image, for people.
    raster : Raster
        Pixels of the image.
    """

    draw: Callable[[View], NDArray[np.float32]]
    inputs: SceneInputs
    volume: Volume | None
    volume_name: str
    lighting: Lighting
    light: LightDirection | None
    drawn_by: Callable[[], str]
    raster: Raster
    close: Callable[[], None]

    def facts(self) -> dict[str, str]:
        """Return the texts of a PNG file."""
        tf = self.inputs.transfer_function
        facts = {
            "Title": f"{self.volume_name}, by {self.drawn_by()}",
            "Volume": self.volume_name,
            "View": view_text(self.inputs.view),
            "Lighting": self.lighting,
            "Renderer": self.drawn_by(),
            "Scalar range": range_text(tf.scalar_range, tf.scale),
            "Transfer function": json.dumps(tf.to_json()),
        }
        if self.light is not None:
            facts["Light"] = f"{self.light.azimuth:g},{self.light.elevation:g}"
        if self.inputs.crop is not None:
            planes = zip(self.inputs.crop.low, self.inputs.crop.high, strict=True)
            facts["Crop"] = ",".join(f"{low:g},{high:g}" for low, high in planes)
        return facts
