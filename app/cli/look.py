"""Scene inputs that are options of the command line, but for the TF."""

from __future__ import annotations

from dataclasses import dataclass

from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.transfer_function import TransferFunction
from model.scene.view import View


@dataclass(frozen=True, kw_only=True)
class Look:
    """Inputs that an order's images depend on, beside volume and TF."""

    view: View
    light: LightDirection | None = None
    crop: CropBox | None = None

    def inputs(self, tf: TransferFunction) -> SceneInputs:
        """Return the inputs of an image under a TF."""
        return SceneInputs.of(self.view, tf, light=self.light, crop=self.crop)
