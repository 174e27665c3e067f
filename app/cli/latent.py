"""``latent``: the map of opacity TFs, and its pictures."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.cli import options, values
from app.cli.options import option
from app.cli.values import range_text, tf_text, view_text
from model.errors import LatentError, RenderError, os_errors_as
from model.files import writing
from model.latent.codes import SAMPLES, Codes
from model.latent.latent_map import LatentMap
from model.latent.latent_space import LatentSpace, draw_cells
from model.networks.card import load_card
from model.scene.inputs import SceneInputs
from model.scene.scene import default_scalar_window
from model.scene.transfer_function import OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.source import VolumeSource, volume_of

Images = NDArray[np.float32]

MAP = 620  # width and height of a figure's map and grid, in pixels

Draw = Callable[[Codes], Images]  # codes (n, d) to images (n, S, S, 4), of codes or of their TFs


@dataclass
class _Found:
    """Arrays for an `.npz` file, and what a figure shows."""

    arrays: dict[str, NDArray[Any]] = field(default_factory=dict)
    grid: Images | None = None
    picture: Images | None = None
    place: tuple[float, float, float] | None = None
    opacity_tf: OpacityTF | None = None


@dataclass(frozen=True, kw_only=True)
class Latent:
    """Compute the map of opacity TFs, and draw pictures of parts of it."""

    out: Path = options.output(
        "OUT.npz: all arrays, OUT.png: a figure, OUT.json: the TF at --at or --near.",
        *(".npz", ".png", ".json"),
        metavar="OUT",
    )
    source: VolumeSource = options.volume()
    model: Path | None = options.model(
        help="Use this model's codec and images, not tfscope's codec and exact images."
    )
    grid: tuple[float, float, float, float] | None = option(
        "Pictures of this rectangle's 4 x 4 cells.",
        metavar="X0,Y0,X1,Y1",
        parser=values.numbers(4, "--grid"),
    )
    at: tuple[float, float] | None = option(
        "The TF interpolated at a place of the map.",
        metavar="X,Y",
        parser=values.numbers(2, "--at"),
    )
    near: Path | None = options.tf(help="Find this TF on the map, and draw the TF of its code.")
    view: View = options.view()
    tf: Path | None = options.tf(help="Colours to draw in. (default: the volume's)")
    size: int = options.size(default=128, help="Pixels; a model has its own size.", max=1024)

    def run(self) -> None:
        """Open or compute the map, answer the question, and write the result."""
        self._check()
        # Late: with it comes torch.
        from app.cli.drawing import load_fitted
        from app.cli.outputs import make_room_for
        from model.volume_files.shipped import first_transfer_function

        if self.model is None:
            volume = self.source.read()
            space = LatentSpace.shipped(
                volume.scalar_range, default_scalar_window(volume), volume.scale
            )
        else:
            volume = volume_of(load_card(self.model).scene, self.source)
            space = LatentSpace.of_model(self.model)
        map_ = final_map(space)
        colors = first_transfer_function(volume)
        if self.tf is not None:
            colors = load_fitted(self.tf, volume.scalar_range, volume.scale)
        draw, close = _drawing(self, volume, space, SceneInputs.of(self.view, colors))
        try:
            found = _Found()
            if self.grid is not None:
                _add_grid(found, map_, self.grid, draw)
            if self.at is not None:
                blend = map_.at(self.at)
                if not blend.samples:
                    print("No sample lies in the disc around this place; the nearest is taken.")
                _add_one(found, space, blend.code, self.at, map_.radius, draw)
            elif self.near is not None:
                tf = load_fitted(self.near, volume.scalar_range, volume.scale)
                code = space.code_of(tf.opacity)
                x, y = map_.place(code)
                print(f"The TF lies near {x:.3f},{y:.3f} on the map.")
                _add_one(found, space, code, (x, y), 0.0, draw)
                found.arrays["neighbours"] = map_.nearest(code, 8)
        finally:
            close()
        make_room_for(self.out)
        if self.out.suffix.lower() == ".png":
            _draw_figure(self, volume, map_, found, colors)
        else:
            _write(self.out, map_, found, colors)
        samples = map_.samples
        singular = ", ".join(f"{value:.3g}" for value in samples.singular_values)
        print(f"{len(samples.codes):,} codes; singular values {singular}.")

    def _check(self) -> None:
        if self.near is not None and (self.grid is not None or self.at is not None):
            raise LatentError("--near finds a place by itself; leave --grid and --at out.")
        if self.model is not None and self.source.is_placed:
            raise LatentError(options.MODEL_RANGE)
        if self.out.suffix.lower() == ".json" and self.at is None and self.near is None:
            raise LatentError(
                f"{self.out}: a JSON file holds one TF; say which by --at or --near.", at="0,0"
            )


def final_map(space: LatentSpace, samples: int = SAMPLES) -> LatentMap:
    """Return the map with its final places; compute and store them if they are missing."""
    map_ = space.open_map(samples)
    if map_.is_final:
        return map_
    from app.cli.console import counting
    from model.latent.embedding import ITERATIONS, EmbeddingProcess

    with counting("computing the map", ITERATIONS) as show:
        places = EmbeddingProcess(map_.codes).run(lambda done: show(round(done * ITERATIONS)))
    assert places is not None
    try:
        space.keep_map(map_.codes, places)
    except LatentError as error:
        print(error)
    return map_.moved(places)


def _drawing(
    asked: Latent, volume: Volume, space: LatentSpace, inputs: SceneInputs
) -> tuple[Draw, Callable[[], None]]:
    """Return a function that draws pictures of codes, and one that releases its renderer."""
    if asked.model is not None:
        from model.generator.generator import Generator

        generator = Generator.load(asked.model)
        return lambda codes: generator.render_latent(codes, inputs), lambda: None
    from model.rendering.raycast.renderer import RaycastRenderer

    renderer = RaycastRenderer(volume)

    def draw(codes: Codes) -> Images:
        tfs = space.tfs_of(codes)
        return np.stack([renderer.render(replace(inputs, opacity_tf=tf), asked.size) for tf in tfs])

    return draw, renderer.close


def _add_grid(
    found: _Found, map_: LatentMap, brush: tuple[float, float, float, float], draw: Draw
) -> None:
    from app.figures.plots import mosaic

    cells = map_.cells(brush)
    if not cells.count.any():
        raise LatentError(
            "There is no sample in this rectangle; the map lies within -1 to 1 along both axes."
        )
    images = draw_cells(cells, draw)
    found.arrays |= {"cells": cells.codes, "count": cells.count, "images": images}
    found.grid = mosaic(images[..., :3])


def _add_one(
    found: _Found,
    space: LatentSpace,
    code: NDArray[np.float32],
    place: tuple[float, float],
    radius: float,
    draw: Draw,
) -> None:
    from model.scene.tf_editing import fitted_curve

    tf, image = space.tf_of(code), draw(code[None])[0]
    arrays = {"code": code, "place": np.array(place), "tf": tf.sample(), "image": image}
    found.arrays |= arrays
    found.picture, found.place = image[..., :3], (*place, radius)
    found.opacity_tf = fitted_curve(tf)


def _draw_figure(
    asked: Latent, volume: Volume, map_: LatentMap, found: _Found, colors: TransferFunction
) -> None:
    from app.figures.plots import PLOT, Page, TFPlot

    drawn_by = "ray caster" if asked.model is None else f"model {asked.model.name}"
    title = f"{volume.name}, view {view_text(asked.view)}, by the {drawn_by}"
    at, grid, picture, place = int(found.grid is not None), found.grid, found.picture, found.place
    widths = [MAP] * (1 + at) + [PLOT] * (picture is not None)
    page = Page(title, widths, [MAP // 2] * 2)
    if grid is not None:
        page.picture(0, 0, "Means of the rectangle's 4 x 4 cells", grid, rows=2)
    name, discs = f"Map of {len(map_.places):,} opacity TFs", [] if place is None else [place]
    page.map(0, at, name, map_.places, asked.grid, discs, rows=2)
    if picture is not None and place is not None and found.opacity_tf is not None:
        page.picture(0, at + 1, f"At {place[0]:.3f},{place[1]:.3f}", picture)
        tf = replace(colors, opacity=found.opacity_tf)
        inputs = SceneInputs.of(asked.view, tf)
        page.tf(1, at + 1, TFPlot.of("Its opacity TF", inputs, volume.units))
    page.save(asked.out, _explanation(asked, volume))


def _explanation(asked: Latent, volume: Volume) -> str:
    facts = ["Grey: samples of opacity TFs, near each other where their codes are"]
    if asked.grid is not None:
        facts.append("orange: a rectangle, whose cells' pictures are on the left")
    if asked.at is not None:
        facts.append("blue: weights of the codes behind the picture on the right")
    elif asked.near is not None:
        facts.append("blue cross: the approximate place of the TF")
    if asked.grid is not None or asked.at is not None or asked.near is not None:
        subject, lighting = "under the decoded TFs", "none"
        if asked.model is not None:
            subject, lighting = "from the latent codes", load_card(asked.model).scene.lighting
        facts.append(
            f"pictures drawn {subject}, colours of the {tf_text(asked.tf)}, lighting {lighting}"
        )
    units = f" {volume.units}" if volume.units else ""
    facts.append(f"TFs over {range_text(volume.scalar_range, volume.scale)}{units}")
    return "; ".join(facts) + "."


def _write(out: Path, map_: LatentMap, found: _Found, colors: TransferFunction) -> None:
    if out.suffix.lower() == ".json":
        assert found.opacity_tf is not None
        replace(colors, opacity=found.opacity_tf).save(out)
        return
    samples = map_.samples
    # An open file, because NumPy appends a suffix to names in capitals.
    with os_errors_as(RenderError, f"{out}: the result cannot be written"), writing(out) as file:
        np.savez_compressed(
            file,
            codes=samples.codes,
            map=map_.places,
            tfs=samples.tfs,
            singular_values=samples.singular_values,
            **found.arrays,  # type: ignore[arg-type]
        )
