"""``sensitivity``: the derivative of an image by the opacity TF, as numbers or as a figure."""

from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cli import options
from app.cli.options import option
from app.cli.outputs import make_room_for
from app.cli.values import range_text, tf_text, view_text
from model.errors import RenderError
from model.networks.card import load_card
from model.networks.names import DeviceChoice
from model.scene.clip_plane import ClipPlane
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting, Scene, default_scalar_window
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.transfer_function import TF_SAMPLES
from model.scene.value_scale import place_of, values_at
from model.scene.view import View
from model.scene.volume import Volume
from model.sensitivity.display import Measure, global_scale
from model.sensitivity.result import Kind, SensitivityResult, save_numbers
from model.volume_files.source import VolumeSource

PAPER_BLOCKS = 16  # blocks along each side of the field of ``blockwise``, as in the paper


class _Answer(NamedTuple):
    """The image, its sensitivity, what computed it, and fields of blocks for a global scale."""

    image: NDArray[np.float32]
    sensitivity: NDArray[np.float32]
    source: str
    lighting: Lighting
    blocks: NDArray[np.float32] | None


_Question = tuple[SceneInputs, NDArray[np.float32] | None, float]
"""Inputs, the edit around the value, and the width of edits in bins."""


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """Find where in the TF an edit changes a region, or where in the image an edit shows."""

    out: Path = options.output(
        "OUT.npz or OUT.csv: all numbers, OUT.png: a figure.",
        *(".png", ".npz", ".csv"),
        metavar="OUT",
    )
    model: Path | None = options.model()
    source: VolumeSource = options.volume()
    engine: Literal["exact", "learned", "blockwise"] | None = option(
        "The ray caster's own derivative, the generator's, or the generator's block by block, as "
        "in the paper. (default: learned with --model, else exact)"
    )
    view: View = options.view()
    tf: Path | None = options.tf()
    lighting: Lighting | None = option("Light of the ray caster's image.")
    size: int | None = options.size(
        default=None, help="Pixels of the rendering; a model has its own size."
    )
    region: Region | None = option(
        "To which values of the TF does this rectangle react? (default: the whole image)",
        metavar="X0,Y0,X1,Y1",
        parser=Region.parse,
    )
    crop: CropBox | None = options.crop()
    clip: ClipPlane | None = options.clip()
    interpolate: bool | None = options.interpolate(
        help="Interpolate between voxels. (default: yes, unless the file says that they are labels)"
    )
    value: float | None = option("Where in the image does this scalar value show?")
    block: int | None = option("All blocks of this many pixels, to edits at all values.", min=1)
    width: float | None = option(
        "Standard deviation of the edits, in the data's units; 0 for single samples of the TF. "
        "(default: 6 of 256 samples)",
        min=0,
    )
    measure: Measure = option(
        "signed: the change of brightness, as in the paper; change: the size of the change, also "
        "where the picture is black.",
        default="signed",
    )
    field_scale: Literal["own", "global"] = option(
        "Scale of a value's figure. own: colours by its field; global: by all values' fields, and "
        "opacity by its own, as in the paper.",
        default="own",
    )
    device: DeviceChoice = options.device()

    def run(self) -> None:
        """Differentiate an image and write the result, replacing an existing file."""
        from app.cli.console import warn_of
        from app.cli.drawing import choose_tf, model_folder

        self._check()
        engine = self.engine or ("exact" if self.model is None else "learned")
        if self.lighting is not None and engine != "exact":
            raise RenderError(
                "A model has the light that it was trained with; leave --lighting out, or give "
                "--engine exact."
            )
        chosen = self.source.is_placed
        if chosen and engine != "exact":
            raise RenderError(options.MODEL_RANGE)
        volume = self.source.read()
        folder = self.model if engine == "exact" else model_folder(self.model, volume)
        scene = None if folder is None else load_card(folder).scene
        if scene is not None and scene.volume_fingerprint == volume.fingerprint and not chosen:
            volume, chosen = volume.over(scene.scalar_range, scene.scale), True
        tf, volume = choose_tf(self.tf, volume, chosen)
        edit, width = _edit(self, volume)
        others = {"crop": self.crop, "clip": self.clip, "interpolates": self.interpolate}
        inputs = SceneInputs.of(self.view, tf, **others)
        compute = _by_renderer if engine == "exact" else _by_generator
        answer = compute(self, volume, scene, (inputs, edit, width))  # type: ignore[arg-type]
        size, whole_scale = len(answer.image), None
        if answer.blocks is not None:
            whole_scale = global_scale(answer.blocks, _block(size) ** 2, width)
        region_pixels = int(self.pixels(size).mask(size).sum())
        result = SensitivityResult(
            kind=self.kind,
            scalar_range=volume.scalar_range,
            scalar_window=default_scalar_window(volume),
            units=volume.units,
            opacity=inputs.opacity_tf.sample(volume.scalar_range),
            image=answer.image,
            sensitivity=answer.sensitivity,
            width=width,
            measure=self.measure,
            source=answer.source,
            place=_place(self, volume),
            pixels=(self.block or 1) ** 2 if self.kind == "blocks" else region_pixels,
            edit=edit,
            colors=inputs.color_tf.sample(volume.scalar_range),
            scale=volume.scale,
            whole_scale=whole_scale,
        )
        make_room_for(self.out)
        if self.out.suffix.lower() == ".png":
            from app.figures.sensitivity_figure import save_figure

            save_figure(self.out, result, _caption(self, volume, answer), self.region)
        else:
            save_numbers(self.out, result)
        warn_of(volume)

    @property
    def kind(self) -> Kind:
        """Kind of the question."""
        if self.value is not None:
            return "value"
        return "region" if self.block is None else "blocks"

    @property
    def by_all_values(self) -> bool:
        """Whether the field's colour scale is that of all values' fields."""
        return self.field_scale == "global"

    def pixels(self, size: int) -> Region:
        """Return the region in an image of a size."""
        return self.region or Region.whole(size)

    def _check(self) -> None:
        given = [self.region, self.value, self.block]
        with_blocks = self.engine == "blockwise" and self.value is not None and not self.region
        if sum(one is not None for one in given) > (2 if with_blocks else 1):
            raise RenderError("Give only one of --region, --value and --block; each is a question.")
        if self.by_all_values and (self.value is None or self.out.suffix.lower() != ".png"):
            raise RenderError(
                "--field-scale is for the figure of a value; give --value and OUT.png."
            )
        if self.block is not None and self.value is None and self.measure == "change":
            raise RenderError(
                "Blocks have the signed measure of the paper; leave --measure out, or give --value."
            )


def _edit(asked: Sensitivity, volume: Volume) -> tuple[NDArray[np.float32] | None, float]:
    """Return the edit around the value, and the width of edits in bins."""
    lo, hi = volume.scalar_range
    width = EDIT_WIDTH if asked.width is None else asked.width / (hi - lo) * (TF_SAMPLES - 1)
    if asked.value is None:
        return None, width
    low, high = values_at(volume.scalar_range, volume.scale)
    if not low <= asked.value <= high:
        raise RenderError(
            f"The value {asked.value:g} is outside the volume's range; give {low:g} to {high:g}."
        )
    return edit_around(place_of(asked.value, volume.scale), volume.scalar_range, width), width


def _by_renderer(
    asked: Sensitivity, volume: Volume, scene: Scene | None, question: _Question
) -> _Answer:
    from app.cli.drawing import DEFAULT_SAMPLE_DISTANCE, DEFAULT_SIZE
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.sensitivity.exact import block_fields, region_responses

    inputs, edit, width = question
    lighting, light = (scene.lighting, scene.light) if scene else ("none", None)
    if asked.lighting is not None:
        lighting, light = asked.lighting, None
    step = scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE
    size = asked.size or (scene.image_size if scene else DEFAULT_SIZE)
    blocks = None
    with closing(RaycastRenderer(volume, lighting, light, step)) as renderer:
        if asked.by_all_values:
            blocks = block_fields(renderer, inputs, size, _block(size), width)
        image = renderer.render(inputs, size)[..., :3]
        if edit is not None:
            found = renderer.change(inputs, size, edit)
        elif asked.block is not None:
            found = block_fields(renderer, inputs, size, asked.block, width)
        else:
            region = asked.pixels(size)
            found = region_responses(renderer, inputs, size, region, width, asked.measure)
    light_name = "" if lighting == "none" else f", {lighting} light"
    return _Answer(image, found, f"exact, by the ray caster{light_name}", lighting, blocks)


def _by_generator(asked: Sensitivity, volume: Volume, scene: Scene, question: _Question) -> _Answer:
    from app.cli.drawing import model_folder, warn_outside

    inputs, edit, width = question
    if scene.volume_fingerprint != volume.fingerprint:
        raise RenderError(
            f"The model was trained on '{scene.volume_name}', not on '{volume.name}'; "
            "name its volume by --volume."
        )
    size = scene.image_size
    if asked.size not in (None, size):
        raise RenderError(f"The model draws {size} x {size} pixels; leave --size out.")
    warn_outside(inputs, scene)
    from model.generator.generator import Generator
    from model.sensitivity import learned

    generator = Generator.load(model_folder(asked.model, volume), asked.device)
    found = learned.Sensitivity(generator, inputs, width)
    blockwise = asked.engine == "blockwise"
    sensitivity: Any
    if edit is not None and blockwise:
        sensitivity = found.blockwise_change(asked.block or _block(size), edit)
    elif edit is not None:
        sensitivity = found.change(edit)
    elif asked.block is not None:
        sensitivity = (found.blockwise if blockwise else found.field)(asked.block)
    elif asked.measure == "change":
        sensitivity = found.change_norms(asked.pixels(size))
    else:
        sensitivity = found.region(asked.pixels(size))
    how = "block by block" if blockwise else "learned"
    image = np.clip(found.image, 0, 1)
    blocks = found.field(_block(size)) if asked.by_all_values else None
    return _Answer(image, sensitivity, f"{how}, by the generator", scene.lighting, blocks)


def _block(size: int) -> int:
    """Width and height of one of the paper's 16 x 16 blocks."""
    return -(-size // PAPER_BLOCKS)


def _place(asked: Sensitivity, volume: Volume) -> str:
    """Say which part of image or TF a result is about."""
    if asked.value is not None:
        return f"edits around {asked.value:g}{f' {volume.units}' if volume.units else ''}"
    if asked.block is not None:
        return f"edits, in blocks of {asked.block} pixels"
    if asked.region is None:
        return "the whole image"
    return "the region " + ",".join(f"{edge}" for edge in vars(asked.region).values())


def _caption(asked: Sensitivity, volume: Volume, answer: _Answer) -> str:
    size, units = len(answer.image), f" {volume.units}" if volume.units else ""
    facts = [
        volume.name,
        f"view {view_text(asked.view)}",
        tf_text(asked.tf),
        f"range {range_text(volume.scalar_range, volume.scale)}{units}",
        f"lighting {answer.lighting}",
        f"{size} x {size} pixels",
    ]
    if asked.engine == "blockwise" and asked.value is not None:
        facts.append(f"r = {-(-size // (asked.block or _block(size)))} blocks along each side")
    return ", ".join(facts) + (", cropped" if asked.crop or asked.clip else "")
