"""Time of sensitivities by ray caster and shipped models, in images of the same engine."""

from contextlib import closing
from statistics import median

from model.generator.catalog import model_for
from model.generator.generator import Generator
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.region import Region
from model.scene.scene import Scene
from model.scene.tf_perturbation import EDIT_WIDTH, edit_around
from model.sensitivity.exact import region_responses, visibility
from model.sensitivity.learned import Sensitivity
from tests.benchmarks.rows import draw_scenes, in_turn, options, parsed, print_rows, volumes


def main(arguments=None):
    """Ask each question about the same scenes."""
    asked = parsed(options(__doc__, count=10, size=256), arguments)
    for volume in volumes(asked):
        inputs = draw_scenes(Scene.of(volume, asked.size, "none"), asked.count)
        with closing(RaycastRenderer(volume, "none")) as renderer:
            ways = exact_ways(renderer, volume, asked.size)
            rows = costs(f"ray caster, {asked.size}", ways, inputs)
        folder = model_for(volume.fingerprint)
        if folder is not None:
            # Derivatives go through torch, so the images are torch's, too.
            generator = Generator.load(folder, "auto")
            own = draw_scenes(generator.scene, asked.count)
            rows += costs(f"model, {generator.scene.image_size}", learned_ways(generator), own)
        print_rows(volume.name, ("engine", "question", "ms", "images"), rows)


def exact_ways(renderer, volume, size):
    """The ray caster's answers; the first is an image."""
    lo, hi = volume.scalar_range
    edit, whole = edit_around((lo + hi) / 2, (lo, hi), EDIT_WIDTH), Region.whole(size)

    def responses(kind):
        return lambda s: region_responses(renderer, s, size, whole, EDIT_WIDTH, kind)

    return {
        "an image": lambda s: renderer.render(s, size),
        "whole image to all values, signed": responses("signed"),
        "the same, size of change": responses("change"),
        "one value to all pixels": lambda s: renderer.change(s, size, edit),
        "visibility": lambda s: visibility(renderer, s, size, whole),
    }


def learned_ways(generator):
    """A model's answers, and the paper's way, block by block; the first is an image."""
    scene = generator.scene
    edit = edit_around(sum(scene.scalar_window) / 2, scene.scalar_range, EDIT_WIDTH)
    whole, block = Region.whole(scene.image_size), -(-scene.image_size // 8)

    def asked(question, *given):
        return lambda s: getattr(Sensitivity(generator, s), question)(*given)

    return {
        "an image": generator.render,
        "whole image to all values, signed": asked("region", whole),
        "the same, size of change": asked("change_norms", whole),
        "one value to all pixels": asked("change", edit),
        "the same in 8 x 8 blocks": asked("blockwise_change", block, edit),
    }


def costs(engine, ways, inputs):
    rounds = list(in_turn(ways, inputs))
    medians = {name: median(found[name][1] for found in rounds) for name in ways}
    image = medians["an image"]
    return [(engine, name, 1e3 * each, each / image) for name, each in medians.items()]


if __name__ == "__main__":
    main()
