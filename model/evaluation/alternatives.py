"""Alternatives to a model that a user could take: a compact volume, or the volume itself.

On some samples of a scene, a model is compared with the volume compressed to the model's bytes
and with the whole volume, both drawn by the ray caster under the scene's light, and with VTK where
it draws the same images.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model import metrics
from model.evaluation.compact_error import restored
from model.generator.generator import Generator
from model.networks.card import add_metrics
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sample_rendering import make_renderer, render_samples
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import EXACT_LIGHTINGS, Scene
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.volume_files.voxel_code import LEAST_BITS, encode_voxels

WORTH_WHILE = 1.5
"""Speed over the ray caster's from which on a model pays although it is less exact."""

TIMED = 3
"""Samples that VTK is timed on: its shadows take seconds for each."""

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
    least = int(LEAST_BITS / 8 * volume.voxels.size) + 1
    coded = encode_voxels(volume.voxels, max(weights, least), volume.missing)
    rows = [_measured("model", generator.render, weights, samples, truth)]
    on_progress(1)
    for name, drawn, needed in (
        ("compact volume", restored(volume, coded), len(coded.data)),
        ("ray caster", volume, volume.scalars.nbytes),
    ):
        renderer = RaycastRenderer(drawn, scene.lighting, scene.light, scene.sample_distance)
        try:
            draw = partial(renderer.render, size=size)
            rows.append(_measured(name, draw, needed, samples, truth))
        finally:
            renderer.close()
        on_progress(len(rows))
    said = verdict(*rows)
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
    """Return True if VTK's images are those of a scene: it has no soft or path-traced light."""
    return scene.lighting not in ("soft", "path")


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
    if scene.lighting in EXACT_LIGHTINGS:
        agreement = sensitivity_agreement(generator, volume, samples[:RECORDED_SENSITIVITIES])
        recorded["sensitivity_agreement"] = agreement.to_json()
    add_metrics(folder, **recorded)
    return str(found["verdict"])


def verdict(model: Alternative, compact: Alternative, renderer: Alternative) -> str:
    """Say in a sentence or two what a model is worth.

    Parameters
    ----------
    model, compact, renderer : Alternative
        The model, the volume compressed to its bytes, and the ray caster.
    """
    faster = renderer.ms / model.ms
    errors = {
        "RMSE": (model.rmse, compact.rmse),
        "EMD": (model.emd, compact.emd),
        "SSIM": (-model.ssim, -compact.ssim),
    }
    nearer = [name for name, (ours, theirs) in errors.items() if ours < theirs]
    rival = "a compact volume of its size"
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
