"""``latent``: the map of opacity TFs, and its pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.progress import Progress

from app.cli.captions import range_text, tf_text, view_text
from app.cli.console import console
from app.cli.latent_order import Brush, LatentOrder, Place
from app.cli.outputs import make_room_for
from app.cli.render import load_fitted
from app.figures.mosaic import mosaic
from model.errors import LatentError, RenderError, reason
from model.files import writing
from model.latent.codes import Codes, PictureOf
from model.latent.embedding import EmbeddingProcess
from model.latent.latent_map import LatentMap
from model.latent.latent_space import LatentSpace
from model.networks.card import load_card
from model.scene.inputs import SceneInputs
from model.scene.scene import default_scalar_window
from model.scene.tf_fitting import fitted_curve
from model.scene.transfer_function import OpacityTF, TransferFunction
from model.scene.volume import Volume
from model.volume_files.first_tf import first_transfer_function
from model.volume_files.source import volume_of

PICTURES: dict[PictureOf, str] = {
    "code": "drawn from the latent codes",
    "tf": "drawn under the decoded TFs",
}
"""Subjects of pictures, for captions."""

Images = NDArray[np.float32]


@dataclass(frozen=True)
class _Engine:
    """Engine that draws pictures of codes.

    Attributes
    ----------
    draw : callable
        From codes (n, d) to images (n, S, S, 4).
    of : {"code", "tf"}
        What of a code is drawn.
    """

    draw: Callable[[Codes], Images]
    close: Callable[[], None]
    of: PictureOf


@dataclass(frozen=True, eq=False)
class _Found:
    """Arrays for an `.npz` file, and what a figure shows.

    Attributes
    ----------
    grid : ndarray, shape (H, W, 3), or None
        Pictures of the cells.
    picture : ndarray, shape (H, W, 3), or None
        Of the place.
    place : tuple of float, or None
        With the radius of its disc, or 0.
    opacity_tf : OpacityTF or None
        Of the place.
    """

    arrays: dict[str, NDArray[Any]]
    grid: Images | None = None
    picture: Images | None = None
    place: tuple[float, float, float] | None = None
    opacity_tf: OpacityTF | None = None

    def beside(self, place: _Found) -> _Found:
        """Return a grid with a place."""
        return replace(place, arrays={**self.arrays, **place.arrays}, grid=self.grid)


def save_latent(order: LatentOrder) -> None:
    """Open or compute the map, answer the question, and write the result."""
    volume = _volume(order)
    if order.model is not None:
        space = LatentSpace.of_model(order.model)
    else:
        space = LatentSpace.shipped(
            volume.scalar_range, default_scalar_window(volume), volume.scale
        )
    map_ = _final(space, space.open_map())
    colors = first_transfer_function(volume)
    if order.tf is not None:
        colors = load_fitted(order.tf, volume.scalar_range, volume.scale)
    inputs = SceneInputs.of(order.view, colors)
    engine = _engine(order, volume, space, inputs)
    try:
        found = _Found({})
        if order.grid is not None:
            found = _grid(map_, order.grid, engine)
        if order.at is not None:
            found = found.beside(_at(space, map_, order.at, engine))
        elif order.near is not None:
            tf = load_fitted(order.near, volume.scalar_range, volume.scale)
            found = _near(space, map_, tf.opacity, engine)
    finally:
        engine.close()
    make_room_for(order.out)
    if order.out.suffix.lower() == ".png":
        _draw_figure(order, volume, map_, found, colors, engine.of)
    else:
        _write(order.out, map_, found, colors)
    _tell(map_)


def _volume(order: LatentOrder) -> Volume:
    if order.model is None:
        return order.volume.read()
    scene = load_card(order.model).scene
    return volume_of(scene, order.volume)


def _final(space: LatentSpace, map_: LatentMap) -> LatentMap:
    """Return the map at its final places, which are computed and kept if need be."""
    if map_.is_final:
        return map_
    places = _compute(map_)
    try:
        space.keep_map(map_.codes, places)
    except LatentError as error:
        console.print(str(error))
    return map_.moved(places)


def _compute(map_: LatentMap) -> NDArray[np.float32]:
    process = EmbeddingProcess(map_.codes)
    with Progress(console=console) as progress:
        task = progress.add_task("Computing the map", total=1.0)
        places = process.run(lambda done: progress.update(task, completed=done))
    assert places is not None
    return places


def _engine(order: LatentOrder, volume: Volume, space: LatentSpace, inputs: SceneInputs) -> _Engine:
    """Return what draws; its pictures have the view and the colours of the inputs."""
    if order.model is not None:
        from model.generator.generator import Generator
        from model.latent.code_pictures import draw_codes

        generator = Generator.load(order.model)
        return _Engine(
            lambda codes: draw_codes(generator, space, codes, inputs, "code"), lambda: None, "code"
        )
    from model.rendering.raycast.renderer import RaycastRenderer

    renderer = RaycastRenderer(volume)

    def draw(codes: Codes) -> Images:
        tfs = space.tfs_of(codes)
        return np.stack([renderer.render(replace(inputs, opacity_tf=tf), order.size) for tf in tfs])

    return _Engine(draw, renderer.close, "tf")


def _grid(map_: LatentMap, brush: Brush, engine: _Engine) -> _Found:
    cells = map_.cells(brush)
    filled = cells.count > 0
    if not filled.any():
        raise LatentError(
            "There is no sample in this rectangle; the map lies within -1 to 1 along both axes."
        )
    drawn = engine.draw(cells.codes[filled])
    images = np.full((*filled.shape, *drawn.shape[1:]), np.nan, dtype=np.float32)
    images[filled] = drawn
    arrays: dict[str, NDArray[Any]] = {"cells": cells.codes, "count": cells.count, "images": images}
    return _Found(arrays, mosaic(images[..., :3]))


def _at(space: LatentSpace, map_: LatentMap, place: Place, engine: _Engine) -> _Found:
    blend = map_.at(place)
    if not blend.samples:
        console.print("No sample lies in the disc around this place; the nearest one is taken.")
    return _one(space, blend.code, np.array(place), engine, map_.radius)


def _near(space: LatentSpace, map_: LatentMap, tf: OpacityTF, engine: _Engine) -> _Found:
    code = space.code_of(tf)
    place = map_.place(code)
    console.print(f"The TF lies near {place[0]:.3f},{place[1]:.3f} on the map.")
    found = _one(space, code, np.array(place), engine)
    return replace(found, arrays={**found.arrays, "neighbours": map_.nearest(code, 8)})


def _one(
    space: LatentSpace,
    code: NDArray[np.float32],
    place: NDArray[np.floating],
    engine: _Engine,
    radius: float = 0.0,
) -> _Found:
    tf = space.tf_of(code)
    image = engine.draw(code[None])[0]
    arrays = {"code": code, "place": place, "tf": tf.sample(), "image": image}
    x, y = (float(number) for number in place)
    return _Found(arrays, None, image[..., :3], (x, y, radius), fitted_curve(tf))


def _draw_figure(
    order: LatentOrder,
    volume: Volume,
    map_: LatentMap,
    found: _Found,
    colors: TransferFunction,
    of: PictureOf,
) -> None:
    from app.figures.latent_figure import LatentFigure, save_latent_figure
    from app.figures.tf_plot import TFPlot

    drawn_by = "ray caster" if order.model is None else f"model {order.model.name}"
    units = f" ({volume.units})" if volume.units else ""
    tf = None
    if found.opacity_tf is not None:
        tf = TFPlot(
            "Its opacity TF",
            volume.scalar_range,
            found.opacity_tf.sample(volume.scalar_range),
            colors.color.sample(volume.scalar_range),
            f"scalar value{units}",
        )
    save_latent_figure(
        order.out,
        LatentFigure(
            f"{volume.name}, view {view_text(order.view)}, by the {drawn_by}",
            map_.places,
            found.grid,
            order.grid,
            found.picture,
            found.place,
            tf,
            _explanation(order, volume, of),
        ),
    )


def _explanation(order: LatentOrder, volume: Volume, of: PictureOf) -> str:
    """Say what the parts of the figure are."""
    facts = ["Grey: samples of opacity TFs, near each other where their codes are"]
    if order.grid is not None:
        facts.append("orange: a rectangle, whose cells' pictures are on the left")
    if order.at is not None:
        facts.append("blue: the weights of the codes that the picture on the right is of")
    elif order.near is not None:
        facts.append("blue cross: the approximate place of the TF")
    if order.grid is not None or order.at is not None or order.near is not None:
        lighting = "none" if order.model is None else load_card(order.model).scene.lighting
        facts.append(
            f"pictures {PICTURES[of]}, colours of the {tf_text(order.tf)}, lighting {lighting}"
        )
    units = f" {volume.units}" if volume.units else ""
    facts.append(f"TFs over {range_text(volume.scalar_range, volume.scale)}{units}")
    return "; ".join(facts) + "."


def _write(out: Path, map_: LatentMap, found: _Found, colors: TransferFunction) -> None:
    suffix = out.suffix.lower()
    try:
        if suffix == ".json":
            assert found.opacity_tf is not None
            replace(colors, opacity=found.opacity_tf).save(out)
        else:
            samples = map_.samples
            # An open file, as numpy appends a suffix to names in capitals.
            with writing(out) as file:
                np.savez_compressed(
                    file,
                    codes=samples.codes,
                    map=map_.places,
                    tfs=samples.tfs,
                    singular_values=samples.singular_values,
                    **found.arrays,  # type: ignore[arg-type]
                )
    except OSError as error:
        raise RenderError(f"{out}: the result cannot be written ({reason(error)}).") from error


def _tell(map_: LatentMap) -> None:
    samples = map_.samples
    values = ", ".join(f"{value:.3g}" for value in samples.singular_values)
    console.print(
        f"{len(samples.codes):,} codes; singular values {values}; "
        f"effective dimension {samples.effective_dimension:.1f} of {samples.codes.shape[1]}."
    )
