"""VTK and the ray caster: images a second, and how far their images are apart."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import fmean

from model.metrics import rmse
from model.rendering.renderer import open_renderer
from model.scene.scene import RendererName
from tests.benchmarks.rows import options, print_machine, print_rows, scenes, timed, volumes

NAMES: tuple[RendererName, ...] = ("vtk", "raycast")


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the same scenes with both in turn."""
    parser = options(__doc__, lighting="none")
    parser.add_argument("--distance", type=float, default=0.5, help="between samples, in voxels")
    asked = parser.parse_args(arguments)
    print_machine()
    rows = []
    for volume in volumes(asked):
        inputs = scenes(volume, asked, asked.lighting)
        renderers = {name: open_renderer(name, volume, asked.lighting) for name in NAMES}
        taken: dict[str, list[float]] = {name: [] for name in NAMES}
        apart = []
        for renderer in renderers.values():
            renderer.sample_distance = asked.distance
            # The first image takes the compilation of shaders and kernels.
            renderer.render(inputs[0], asked.size)
        for scene in inputs:
            images = {}
            for name, renderer in renderers.items():
                images[name], seconds = timed(lambda r=renderer, s=scene: r.render(s, asked.size))
                taken[name].append(seconds)
            apart.append(rmse(images["vtk"][..., :3], images["raycast"][..., :3]))
        for renderer in renderers.values():
            renderer.close()
        vtk, raycast = (1 / fmean(taken[name]) for name in NAMES)
        rows.append((volume.name, vtk, raycast, raycast / vtk, fmean(apart), max(apart)))
    heading = ("volume", "VTK, images/s", "ray caster", "ratio", "RMSE", "largest")
    print_rows(f"{asked.lighting}, {asked.size} x {asked.size}", heading, rows)


if __name__ == "__main__":
    main()
