"""Time of sensitivities by ray caster and shipped models, in images of the same engine."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from statistics import median

from model.generator.catalog import model_for
from model.generator.generator import Generator
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.region import Region
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.scene.volume import Volume
from model.sensitivity.exact import region_responses, visibility
from model.sensitivity.learned import Sensitivity
from tests.benchmarks.rows import options, print_machine, print_rows, scenes, timed, volumes

Ways = dict[str, Callable[[SceneInputs], object]]


def main(arguments: Sequence[str] | None = None) -> None:
    """Ask each question about the same scenes."""
    asked = options(__doc__, lighting="none").parse_args(arguments)
    print_machine()
    for volume in volumes(asked):
        inputs = scenes(volume, asked, asked.lighting)
        with closing(RaycastRenderer(volume, asked.lighting)) as renderer:
            rows = costs(
                f"ray caster, {asked.size}", exact_ways(renderer, volume, asked.size), inputs
            )
        folder = model_for(volume.fingerprint)
        if folder is not None:
            # Derivatives go through torch, so the images are torch's, too.
            generator = Generator.load(folder, "auto")
            own = [
                draw_sample(generator.scene, asked.seed, "holdout", i) for i in range(asked.count)
            ]
            rows += costs(f"model, {generator.scene.image_size}", learned_ways(generator), own)
        print_rows(f"{volume.name}, {asked.lighting}", ("engine", "question", "ms", "images"), rows)


def exact_ways(renderer: RaycastRenderer, volume: Volume, size: int) -> Ways:
    """Return the ray caster's answers; the first is an image."""
    lo, hi = volume.scalar_range
    edit = edit_around((lo + hi) / 2, (lo, hi), EDIT_WIDTH)
    whole, half = Region.whole(size), size // 2
    quarter = Region(half // 2, half // 2, half // 2 + half, half // 2 + half)
    return {
        "an image": lambda s: renderer.render(s, size),
        "whole image to all values, signed": lambda s: region_responses(
            renderer, s, size, whole, EDIT_WIDTH, "signed"
        ),
        "the same, size of change": lambda s: region_responses(
            renderer, s, size, whole, EDIT_WIDTH, "change"
        ),
        "a quarter, size of change": lambda s: region_responses(
            renderer, s, size, quarter, EDIT_WIDTH, "change"
        ),
        "one value to all pixels": lambda s: renderer.change(s, size, edit),
        "visibility": lambda s: visibility(renderer, s, size, whole),
    }


def learned_ways(generator: Generator) -> Ways:
    """Return a model's answers, and the paper's way, block by block; the first is an image."""
    scene = generator.scene
    edit = edit_around(sum(scene.scalar_window) / 2, scene.scalar_range, EDIT_WIDTH)
    whole, block = Region.whole(scene.image_size), -(-scene.image_size // 8)
    return {
        "an image": generator.render,
        "whole image to all values, signed": lambda s: Sensitivity(generator, s).region(whole),
        "the same, size of change": lambda s: Sensitivity(generator, s).change_norms(whole),
        "one value to all pixels": lambda s: Sensitivity(generator, s).change(edit),
        "the same in 8 x 8 blocks": lambda s: Sensitivity(generator, s).blockwise_change(
            block, edit
        ),
    }


def costs(engine: str, ways: Ways, inputs: list[SceneInputs]) -> list[tuple[object, ...]]:
    """Time all ways in turn on each scene; the first round includes compilation."""
    taken: dict[str, list[float]] = {name: [] for name in ways}
    for scene in (inputs[0], *inputs):
        for name, way in ways.items():
            taken[name].append(timed(lambda way=way, s=scene: way(s))[1])
    medians = {name: median(times[1:]) for name, times in taken.items()}
    image = medians["an image"]
    return [(engine, name, 1e3 * each, each / image) for name, each in medians.items()]


if __name__ == "__main__":
    main()
