"""``sensitivity``: the derivative of an image by the opacity TF, as numbers or as a figure."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.cli.captions import range_text, tf_text, view_text
from app.cli.choices import SensitivityEngine
from app.cli.outputs import make_room_for
from app.cli.render import (
    DEFAULT_SAMPLE_DISTANCE,
    DEFAULT_SIZE,
    MODEL_RANGE,
    choose_tf,
    model_folder,
    warn_outside,
)
from app.cli.sensitivity_order import SensitivityOrder
from model.errors import RenderError
from model.networks.card import load_card
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.scene import Lighting, default_scalar_window
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.transfer_function import TF_SAMPLES, TransferFunction
from model.scene.value_scale import place_of, values_at
from model.scene.volume import Volume
from model.sensitivity.display import Measure, global_scale
from model.sensitivity.result import Kind, SensitivityResult, save_numbers

PAPER_BLOCKS = 16
"""Blocks along each side by which ``blockwise`` makes the field of a value, as in the paper."""


@dataclass(frozen=True)
class _Question:
    """A question in the units of the engines.

    Attributes
    ----------
    kind : {"region", "value", "blocks"}
    region : Region or None
        None is the whole image.
    edit : ndarray of float32, shape (256,)
        Around the value.
    block : int or None
        Width and height of blocks in pixels.
    width : float
        In bins.
    measure : {"change", "signed"}
    """

    kind: Kind
    inputs: SceneInputs
    region: Region | None
    edit: NDArray[np.float32] | None
    block: int | None
    width: float
    measure: Measure

    def pixels(self, size: int) -> Region:
        """Return the region in an image of a size."""
        return self.region or Region.whole(size)


@dataclass(frozen=True)
class _Answer:
    """The image, its sensitivity, who computed it, and the light of the image.

    `blocks` has the fields of all values, shape (n, n, 256), where colours are to be by them.
    """

    image: NDArray[np.float32]
    sensitivity: NDArray[np.float32]
    source: str
    lighting: Lighting
    blocks: NDArray[np.float32] | None = None


def save_sensitivity(order: SensitivityOrder) -> None:
    """Differentiate an image and write the result, replacing an existing file."""
    _check_question(order)
    engine = order.engine or ("exact" if order.model is None else "learned")
    if order.lighting is not None and engine != "exact":
        raise RenderError(
            "A model has the light that it was trained with; leave --lighting out, or give "
            "--engine exact."
        )
    chosen = order.volume.is_placed
    if chosen and engine != "exact":
        raise RenderError(MODEL_RANGE)
    volume = order.volume.read()
    folder = order.model if engine == "exact" else model_folder(order.model, volume)
    scene = None if folder is None else load_card(folder).scene
    if scene is not None and scene.volume_fingerprint == volume.fingerprint and not chosen:
        volume, chosen = volume.over(scene.scalar_range, scene.scale), True
    tf, volume = choose_tf(order.tf, volume, chosen)
    question = _question(order, volume, tf)
    ways: dict[SensitivityEngine, Callable[[SensitivityOrder, Volume, _Question], _Answer]] = {
        "exact": _by_renderer,
        "learned": _by_generator,
        "blockwise": _by_generator,
    }
    _save(order, volume, question, ways[engine](order, volume, question))


def _save(order: SensitivityOrder, volume: Volume, question: _Question, answer: _Answer) -> None:
    result = _result(order, volume, question, answer)
    make_room_for(order.out)
    if order.out.suffix.lower() == ".png":
        from app.figures.sensitivity_figure import save_figure

        save_figure(order.out, result, _caption(order, volume, answer), order.region)
    else:
        save_numbers(order.out, result)


def _check_question(order: SensitivityOrder) -> None:
    asked = [order.region, order.value, order.block]
    with_blocks = order.engine == "blockwise" and order.value is not None and not order.region
    if sum(one is not None for one in asked) > (2 if with_blocks else 1):
        raise RenderError("Give one of --region, --value and --block, as each is a question.")
    if order.by_all_values and (order.value is None or order.out.suffix.lower() != ".png"):
        raise RenderError("A scale is that of a value's figure; give --value and OUT.png.")
    if order.block is not None and order.value is None and order.measure == "change":
        raise RenderError(
            "Blocks have the signed measure of the paper; leave --measure out, or give --value."
        )


def _question(order: SensitivityOrder, volume: Volume, tf: TransferFunction) -> _Question:
    lo, hi = volume.scalar_range
    low, high = values_at(volume.scalar_range, volume.scale)
    if order.value is not None and not low <= order.value <= high:
        raise RenderError(
            f"The value {order.value:g} is outside the volume's range; give {low:g} to {high:g}."
        )
    width = EDIT_WIDTH if order.width is None else order.width / (hi - lo) * (TF_SAMPLES - 1)
    edit, kind = None, "region"
    if order.value is not None:
        edit, kind = (
            edit_around(place_of(order.value, volume.scale), volume.scalar_range, width),
            "value",
        )
    elif order.block is not None:
        kind = "blocks"
    return _Question(
        kind,  # type: ignore[arg-type]
        order.inputs(tf),
        order.region,
        edit,
        order.block,
        width,
        order.measure,
    )


def _by_renderer(order: SensitivityOrder, volume: Volume, asked: _Question) -> _Answer:
    from model.rendering.raycast.renderer import RaycastRenderer
    from model.sensitivity.exact import block_fields, region_responses

    scene = load_card(order.model).scene if order.model else None
    lighting: Lighting = scene.lighting if scene else "none"
    light = scene.light if scene else None
    if order.lighting is not None:
        lighting, light = order.lighting, None
    step = scene.sample_distance if scene else DEFAULT_SAMPLE_DISTANCE
    size = order.size or (scene.image_size if scene else DEFAULT_SIZE)
    blocks = None
    with closing(RaycastRenderer(volume, lighting, light, step)) as renderer:
        if order.by_all_values:
            blocks = block_fields(renderer, asked.inputs, size, _block(size), asked.width)
        image = renderer.render(asked.inputs, size)[..., :3]
        if asked.edit is not None:
            found = renderer.change(asked.inputs, size, asked.edit)
        elif asked.block is not None:
            found = block_fields(renderer, asked.inputs, size, asked.block, asked.width)
        else:
            found = region_responses(
                renderer, asked.inputs, size, asked.pixels(size), asked.width, asked.measure
            )
    light_name = "" if lighting == "none" else f", {lighting} light"
    return _Answer(image, found, f"exact, by the ray caster{light_name}", lighting, blocks)


def _by_generator(order: SensitivityOrder, volume: Volume, asked: _Question) -> _Answer:
    folder = model_folder(order.model, volume)
    scene = load_card(folder).scene
    if scene.volume_fingerprint != volume.fingerprint:
        raise RenderError(
            f"The model was trained on '{scene.volume_name}', not on '{volume.name}'; "
            "name its volume by --volume."
        )
    if order.size not in (None, scene.image_size):
        raise RenderError(
            f"The model draws {scene.image_size} x {scene.image_size} pixels; leave --size out."
        )
    warn_outside(asked.inputs, scene)
    from model.generator.generator import Generator
    from model.sensitivity.learned import Sensitivity

    generator = Generator.load(folder, order.device)
    found = Sensitivity(generator, asked.inputs, asked.width)
    blockwise = order.engine == "blockwise"
    sensitivity: Any
    if asked.edit is not None and blockwise:
        block = asked.block or _block(scene.image_size)
        sensitivity = found.blockwise_change(block, asked.edit)
    elif asked.edit is not None:
        sensitivity = found.change(asked.edit)
    elif asked.block is not None:
        sensitivity = (found.blockwise if blockwise else found.field)(asked.block)
    elif asked.measure == "change":
        sensitivity = found.change_norms(asked.pixels(scene.image_size))
    else:
        sensitivity = found.region(asked.pixels(scene.image_size))
    how = "block by block" if blockwise else "learned"
    image = np.clip(found.image, 0, 1)
    blocks = found.field(_block(scene.image_size)) if order.by_all_values else None
    return _Answer(image, sensitivity, f"{how}, by the generator", scene.lighting, blocks)


def _block(size: int) -> int:
    """Width and height of the paper's blocks, of which there are 16 x 16."""
    return -(-size // PAPER_BLOCKS)


def _result(
    order: SensitivityOrder, volume: Volume, asked: _Question, answer: _Answer
) -> SensitivityResult:
    size = len(answer.image)
    units = f" {volume.units}" if volume.units else ""
    places = {
        "region": f"the region {_edges(order.region)}" if order.region else "the whole image",
        "value": f"edits around {order.value:g}{units}" if order.value is not None else "",
        "blocks": f"edits, in blocks of {order.block} pixels",
    }
    return SensitivityResult(
        kind=asked.kind,
        scalar_range=volume.scalar_range,
        scalar_window=default_scalar_window(volume),
        units=volume.units,
        opacity=asked.inputs.opacity_tf.sample(volume.scalar_range),
        image=answer.image,
        sensitivity=answer.sensitivity,
        width=asked.width,
        measure=asked.measure,
        source=answer.source,
        place=places[asked.kind],
        pixels=(asked.block or 1) ** 2
        if asked.kind == "blocks"
        else int(asked.pixels(size).mask(size).sum()),
        edit=asked.edit,
        colors=asked.inputs.color_tf.sample(volume.scalar_range),
        scale=volume.scale,
        whole_scale=None
        if answer.blocks is None
        else global_scale(answer.blocks, _block(size) ** 2, asked.width),
    )


def _edges(region: Region) -> str:
    return f"{region.left},{region.top},{region.right},{region.bottom}"


def _caption(order: SensitivityOrder, volume: Volume, answer: _Answer) -> str:
    """Return what the image shows, for below the title of a figure."""
    size, units = len(answer.image), f" {volume.units}" if volume.units else ""
    facts = [
        volume.name,
        f"view {view_text(order.view)}",
        tf_text(order.tf),
        f"range {range_text(volume.scalar_range, volume.scale)}{units}",
        f"lighting {answer.lighting}",
        f"{size} x {size} pixels",
    ]
    if order.engine == "blockwise" and order.value is not None:
        facts.append(f"r = {-(-size // (order.block or _block(size)))} blocks along each side")
    return ", ".join(facts) + (", cropped" if order.crop is not None else "")
