"""Scene inputs: the variables that one image of a scene depends on, declared once.

:data:`INPUT_FIELDS` defines for each input that models are trained with its random distribution,
its stored form, its encoding for networks, and the check against the scene's training range.
Sampler, store and networks follow this table. Other inputs are in :data:`CHOSEN`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.scene.clip_plane import ClipPlane, ShownPart
from model.scene.crop import CropBox
from model.scene.mask import Mask
from model.scene.random_inputs import draw_color_tf, draw_light, draw_opacity_tf, draw_view
from model.scene.scene import LightDirection, LightRange, Scene
from model.scene.transfer_function import TF_SAMPLES, ColorTF, OpacityTF, TransferFunction
from model.scene.view import VIEW_PARAMETERS, View, upright_frame
from model.scene.volume import Volume

_LAB_LOW = np.array([0.0, -86.185, -107.863])
_LAB_HIGH = np.array([100.0, 98.254, 94.482])  # extent of the RGB cube in CIELAB (L, a, b)


def rgb_to_lab(rgb: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convert sRGB (..., 3) to CIELAB, each channel scaled so that the RGB cube fills [-1, 1]."""
    # Imported here: it takes most of a second, and few commands need it.
    from skimage.color import rgb2lab

    lab = rgb2lab(np.clip(rgb, 0.0, 1.0))
    return (2 * (lab - _LAB_LOW) / (_LAB_HIGH - _LAB_LOW) - 1).astype(np.float32)


Arrays = dict[str, NDArray[Any]]  # stored inputs of N images by name, each of shape (N, ...)


@dataclass(frozen=True)
class SceneInputs:
    """Everything that one image of a scene depends on."""

    view: View
    opacity_tf: OpacityTF
    color_tf: ColorTF
    light: LightDirection | None = None  # None for the scene's fixed light, or none
    crop: CropBox | None = None  # shown part of the volume; None for all of it
    clip: ClipPlane | None = None  # plane beyond which the volume is cut away
    interpolates: bool | None = None  # whether to interpolate; None for yes, except labels
    mask: Mask | None = None  # shown voxels; None for all

    @classmethod
    def of(cls, view: View, tf: TransferFunction, **others: Any) -> SceneInputs:
        """Build inputs from a view and a pair of TFs; `others` are further fields by name."""
        return cls(view, tf.opacity, tf.color, **others)

    @property
    def transfer_function(self) -> TransferFunction:
        """Both TFs as a pair."""
        return TransferFunction(self.opacity_tf, self.color_tf)

    @property
    def part(self) -> ShownPart:
        """The part left by crop box and clipping plane."""
        return ShownPart(self.crop or CropBox(), self.clip)

    def is_nearest(self, volume: Volume) -> bool:
        """Whether each point of a volume has the nearest voxel's value."""
        return volume.file.is_labels if self.interpolates is None else not self.interpolates


@dataclass(frozen=True)
class InputField:
    """Definition of one scene input for sampler, store and networks."""

    name: str  # name of the field of `SceneInputs` and of the stored array
    shape: tuple[int, ...]  # shape of one stored value
    dtype: str  # data type of stored values
    numbers: int  # length in the condition vector; 0 for TFs
    draw: Callable[[np.random.Generator, Scene, dict[str, Any]], Any]
    """Draws a value, given a random generator, the scene and the inputs drawn before."""
    store: Callable[[Any, Scene], NDArray[Any]]  # converts a value to an array of `shape`
    encode: Callable[[NDArray[Any], Scene], NDArray[np.float32]]
    """Encodes stored values (N, ...) as float32, in [-1, 1] inside the scene's ranges."""
    outside: Callable[[Any, Scene], list[str]]  # parts of a value outside the training range
    varies: Callable[[Scene], bool] = lambda scene: True
    """Returns True if the input varies among images of a scene; otherwise it is neither drawn,
    stored nor encoded."""


def _view_outside(view: View, scene: Scene) -> list[str]:
    trained = scene.view_range
    view = view.in_frame(upright_frame(trained.up))
    found = []
    if abs(view.elevation) > trained.max_elevation:
        found.append(f"elevation {view.elevation:.0f}° (±{trained.max_elevation:g}°)")
    if abs(view.roll) > trained.max_roll:
        axis = trained.up.replace("-", "−")
        found.append(f"roll {view.roll:.0f}° (±{trained.max_roll:g}° with {axis} up)")
    if not trained.nearest <= view.distance <= trained.farthest:
        found.append(f"distance {view.distance:.2f} ({trained.nearest:g} to {trained.farthest:g})")
    if view.is_orthographic:
        found.append("an orthographic view")
    return found


def _opacity_outside(opacity: OpacityTF, scene: Scene) -> list[str]:
    lo, hi = scene.scalar_window
    strays = sum(not lo <= mode.mean <= hi for mode in opacity.modes)
    found = []
    if strays:
        what = "a mode" if strays == 1 else f"{strays} modes"
        found.append(f"{what} beyond {lo:.4g} to {hi:.4g}")
    if opacity.points and scene.tf_family == "paper":
        found.append("a free opacity curve")
    return found


def _light_outside(light: LightDirection | None, scene: Scene) -> list[str]:
    trained = scene.light_range
    if light is None or trained is None:
        return []
    found = []
    if abs(light.azimuth) > trained.max_azimuth:
        found.append(f"light azimuth {light.azimuth:.0f}° (±{trained.max_azimuth:g}°)")
    if abs(light.elevation) > trained.max_elevation:
        found.append(f"light elevation {light.elevation:.0f}° (±{trained.max_elevation:g}°)")
    return found


INPUT_FIELDS: tuple[InputField, ...] = (
    InputField(
        name="view",
        shape=(4,),
        dtype="float64",
        numbers=VIEW_PARAMETERS,
        draw=lambda rng, scene, drawn: draw_view(rng, scene.view_range),
        # Samples are not panned.
        store=lambda view, scene: np.array([*vars(view).values()][:4]),
        encode=lambda rows, scene: np.stack(
            [View(*map(float, row)).vector(scene.view_range) for row in rows]
        ),
        outside=_view_outside,
    ),
    InputField(
        name="opacity_tf",
        shape=(TF_SAMPLES,),
        dtype="float32",
        numbers=0,
        draw=lambda rng, scene, drawn: draw_opacity_tf(rng, scene),
        store=lambda tf, scene: tf.sample(scene.scalar_range),
        encode=lambda rows, scene: 2 * rows.astype(np.float32) - 1,
        outside=_opacity_outside,
    ),
    InputField(
        name="color_tf",
        shape=(TF_SAMPLES, 3),
        dtype="float32",
        numbers=0,
        draw=lambda rng, scene, drawn: draw_color_tf(rng, scene, drawn["opacity_tf"]),
        store=lambda tf, scene: tf.sample(scene.scalar_range),
        # Networks take CIELAB, channels first (paper, section 6).
        encode=lambda rows, scene: np.ascontiguousarray(rgb_to_lab(rows).transpose(0, 2, 1)),
        outside=lambda tf, scene: [],
    ),
    InputField(
        name="light",
        shape=(2,),
        dtype="float64",
        numbers=3,
        varies=lambda scene: scene.light_range is not None,
        draw=lambda rng, scene, drawn: draw_light(rng, scene.light_range or LightRange()),
        store=lambda light, scene: np.array([*vars(light or scene.light).values()]),
        encode=lambda rows, scene: np.array(
            [LightDirection(*map(float, row)).towards() for row in rows], np.float32
        ),
        outside=_light_outside,
    ),
)
"""Inputs that models are trained with, in drawing order; `view` is the first condition."""

CHOSEN = {
    "crop": "a crop box", "clip": "a clipping plane", "interpolates": "another interpolation",
    "mask": "a mask",
}  # fmt: skip
"""Inputs that only users choose, and their names; models support None only."""


def varying(scene: Scene) -> list[InputField]:
    """Return the inputs that vary among images of a scene."""
    return [field for field in INPUT_FIELDS if field.varies(scene)]


def condition_numbers(scene: Scene) -> int:
    """Return the length of the condition vector: 5 for the view, and any other conditions."""
    return sum(field.numbers for field in varying(scene))


def draw_inputs(rng: np.random.Generator, scene: Scene) -> SceneInputs:
    """Draw random inputs of a scene (paper, section 4.3.1)."""
    drawn: dict[str, Any] = {}
    for field in varying(scene):
        drawn[field.name] = field.draw(rng, scene, drawn)
    return SceneInputs(**drawn)


def store_inputs(inputs: Sequence[SceneInputs], scene: Scene) -> Arrays:
    """Convert the varying inputs of N images to stored arrays (N, ...)."""
    return {
        field.name: np.stack([field.store(getattr(i, field.name), scene) for i in inputs]).astype(
            field.dtype, copy=False
        )
        for field in varying(scene)
    }


def encode_inputs(arrays: Arrays, scene: Scene) -> dict[str, NDArray[np.float32]]:
    """Encode inputs, as :func:`store_inputs` returns them, for the networks.

    The result, in [-1, 1] inside the scene's ranges, has "conditions" (N, C), the view parameters
    followed by other conditions, and each TF under its name.
    """
    encoded = {f.name: f.encode(arrays[f.name], scene) for f in varying(scene)}
    conditions = [encoded.pop(f.name) for f in varying(scene) if f.numbers]
    return {"conditions": np.concatenate(conditions, axis=1), **encoded}


def outside_range(inputs: SceneInputs, scene: Scene) -> str:
    """Describe the inputs outside a generator's training range in one line; empty if none."""
    parts = [text for f in INPUT_FIELDS for text in f.outside(getattr(inputs, f.name), scene)]
    parts += [text for name, text in CHOSEN.items() if getattr(inputs, name) is not None]
    found = ", ".join(parts)
    return f"Outside the training range: {found}" if found else ""


assert {f.name for f in fields(SceneInputs)} == {f.name for f in INPUT_FIELDS} | CHOSEN.keys()
