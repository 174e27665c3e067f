"""Alternatives to a model that a user could take: a coarse volume, or the ray caster itself.

On some samples of a scene, a model is compared with the volume averaged to
half its resolution, with the volume averaged to the model's bytes, both drawn by the ray
caster's kernels under the scene's light, with the ray caster on the whole volume, and with VTK
where it draws the same images.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from model import metrics
from model.generator.generator import Generator
from model.networks.card import add_metrics
from model.networks.refined.coarse_volume import CoarseVolume
from model.networks.refined.refined_generator import RefinedGenerator
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement

WORTH_WHILE = 1.5
"""Speed over the ray caster's from which on a model pays although it is less exact."""

TIMED = 3
"""Samples that VTK is timed on: its scattering takes seconds for each."""

RECORDED = 48
"""Samples that the sentence in a model's card is measured on."""

RECORDED_SENSITIVITIES = 24
"""Number of those whose sensitivities are compared with the exact ones."""

Draw = Callable[[SceneInputs], NDArray[np.float32]]


@dataclass(frozen=True)
class Alternative:
    """One way to draw the scene, measured.

    Attributes
    ----------
    name : str
    rmse, ssim, emd : float
        Means over samples.
    ms : float
        Median milliseconds of an image, each with another view and other TFs.
    bytes : int
        Of what is needed to draw.
    """

    name: str
    rmse: float
    ssim: float
    emd: float
    ms: float
    bytes: int


def compare_alternatives(
    generator: Generator,
    folder: Path,
    volume: Volume,
    samples: Sequence[SceneInputs],
    images: NDArray[np.uint8],
    on_progress: Callable[[int], None] = lambda done: None,
) -> dict[str, Any]:
    """Measure a model and its alternatives on the same samples.

    Parameters
    ----------
    generator : Generator
    folder : Path
        The model's, for its bytes.
    volume : Volume
        The scene's.
    samples : sequence of SceneInputs
        Views and TFs that were not used for training.
    images : ndarray of uint8, shape (N, S, S, 4)
        Their true images.
    on_progress : callable
        Called with the number of alternatives measured.

    Returns
    -------
    dict
        Plain data: "count", "rows" (:class:`Alternative`, the model first) and "verdict".
    """
    scene = generator.scene
    truth, size = images[..., :3] / 255, scene.image_size
    weights = sum(path.stat().st_size for path in folder.glob("generator-*.safetensors"))
    half = math.prod(-(-n // 2) for n in volume.dimensions)
    renderer = RaycastRenderer(volume, scene.lighting, scene.light, scene.sample_distance)
    ways: list[tuple[str, Draw, int]] = [
        ("model", generator.render, weights),
        ("volume at half resolution", _coarse(generator, volume, half), half),
        ("volume at the model's bytes", _coarse(generator, volume, weights), weights),
        ("ray caster", lambda inputs: renderer.render(inputs, size), volume.scalars.nbytes),
    ]
    rows = []
    try:
        for done, (name, draw, needed) in enumerate(ways, start=1):
            rows.append(_measured(name, draw, needed, samples, truth))
            on_progress(done)
    finally:
        renderer.close()
    said = verdict(rows[0], rows[2], rows[3])
    if is_drawn_by_vtk(scene):
        vtk = make_renderer(volume, replace(scene, renderer="vtk"))
        try:
            rows.append(
                _measured(
                    "VTK",
                    lambda inputs: vtk.render(inputs, size),
                    volume.scalars.nbytes,
                    samples[:TIMED],
                    truth[:TIMED],
                )
            )
        finally:
            vtk.close()
        on_progress(len(rows))
        said += f" VTK takes {_times(rows[-1].ms / rows[0].ms)} as long as the model."
    return {"count": len(samples), "rows": [asdict(row) for row in rows], "verdict": said}


def is_drawn_by_vtk(scene: Scene) -> bool:
    """Return True if VTK's images are those of a scene: all but the ray caster's global light."""
    return scene.renderer == "vtk" or scene.lighting != "global"


def record_verdict(folder: Path, volume: Volume) -> str:
    """Compare a model with its alternatives, and write the verdict into its card.

    Where exact sensitivities are there, the agreement of the model's is written, too.

    Parameters
    ----------
    folder : Path
        The model's.
    volume : Volume
        The scene's.

    Returns
    -------
    str
        The verdict.
    """
    generator = Generator.load(folder, "auto", "auto", "auto")
    scene, seed = generator.scene, int(generator.card.training.get("dataset_seed", 0))
    volume = volume.over(scene.scalar_range, scene.scale)
    renderer = make_renderer(volume, scene, threads=None)
    try:
        rendered = render_samples(renderer, scene, seed, "holdout", range(RECORDED))
    finally:
        renderer.close()
    samples = [draw_sample(scene, seed, "holdout", index) for index in range(RECORDED)]
    found = compare_alternatives(generator, folder, volume, samples, rendered.rgba)
    recorded: dict[str, Any] = {"alternatives": found}
    if scene.lighting != "global":
        agreement = sensitivity_agreement(generator, volume, samples[:RECORDED_SENSITIVITIES])
        recorded["sensitivity_agreement"] = agreement.to_json()
    add_metrics(folder, **recorded)
    return str(found["verdict"])


def verdict(model: Alternative, coarse: Alternative, renderer: Alternative) -> str:
    """Say in a sentence or two what a model is worth.

    Parameters
    ----------
    model, coarse, renderer : Alternative
        The model, the volume averaged to its bytes, and the ray caster.
    """
    faster = renderer.ms / model.ms
    errors = {
        "RMSE": (model.rmse, coarse.rmse),
        "EMD": (model.emd, coarse.emd),
        "SSIM": (-model.ssim, -coarse.ssim),
    }
    nearer = [name for name, (ours, theirs) in errors.items() if ours < theirs]
    rival = "a coarse copy of the volume in a file as small"
    quality = f"{'' if nearer else 'not '}nearer to the truth than {rival}"
    if 0 < len(nearer) < len(errors):
        quality += f" (in {', '.join(nearer)})"
    fast, slow = f"{faster:.1f} times as fast", f"takes {1 / faster:.1f} times as long"
    if faster >= WORTH_WHILE or model.rmse < renderer.rmse:
        speed = f"is {fast}" if faster >= 1 else slow
        return f"This model pays: it {speed} as the ray caster, and is {quality}."
    speed = f"is only {fast}" if faster >= 1 else slow
    link = ": it is" if nearer else ", though it is"
    return (
        f"This model is for where the volume's file is not{link} {quality}. With the file at "
        f"hand, the ray caster is exact, and the model {speed}."
    )


def _times(ratio: float) -> str:
    return f"{ratio:.0f} times" if ratio >= 10 else f"{ratio:.1f} times"


def _coarse(generator: Generator, volume: Volume, most: int) -> Draw:
    """Return a function that draws a plainly averaged volume under the scene's light."""
    # In the ray caster's light there is nothing to refine.
    scene = replace(generator.scene, renderer="raycast", dimensions=volume.dimensions)
    size = replace(generator.card.size, architecture="refined", opacity_size=scene.image_size)
    network = RefinedGenerator(size, scene, CoarseVolume.plain(volume, most))
    card = replace(generator.card, scene=scene, size=size)
    return Generator(card, network.requires_grad_(False), torch.device("cpu")).render


def _measured(
    name: str, draw: Draw, needed: int, samples: Sequence[SceneInputs], truth: NDArray[np.float64]
) -> Alternative:
    draw(samples[0])  # what is prepared for the first image is not timed
    images, seconds = [], []
    for sample in samples:
        start = time.perf_counter()
        images.append(draw(sample)[..., :3])
        seconds.append(time.perf_counter() - start)
    pairs = list(zip(images, truth, strict=True))
    return Alternative(
        name,
        rmse=float(np.mean([metrics.rmse(a, b) for a, b in pairs])),
        ssim=float(np.mean([metrics.ssim(a, b) for a, b in pairs])),
        emd=float(np.mean([metrics.color_emd(a, b) for a, b in pairs])),
        ms=1000 * float(np.median(seconds)),
        bytes=needed,
    )
