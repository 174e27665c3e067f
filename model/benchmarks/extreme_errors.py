"""Largest errors of pictures, sensitivities and codes at the extremes, against 64 bits."""

from __future__ import annotations

import copy
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from model.benchmarks import reference_light
from model.benchmarks.extremes import Extreme, Posed, extremes
from model.errors import TfscopeError
from model.rendering.renderer import open_renderer
from model.scene.scene import Lighting, RendererName
from model.scene.transfer_function import TF_SAMPLES, ColorTF

DISTANCE = 0.5
"""Sample distance in voxels."""

EDITS = ((40.0, 0.0), (128.0, 0.0), (128.0, 20.0), (220.0, 12.0))
"""Edits of TFs: their middle and standard deviation in bins, 0 for a single bin."""

Found = float | str
"""An error, or the message by which the scene was refused."""


@dataclass(frozen=True)
class Row:
    """Measurements of one extreme.

    Attributes
    ----------
    pictures, sensitivities, codes : dict of float or str
        By the column of :data:`PICTURES`, :data:`SENSITIVITIES` and :data:`CODES`. NaN where a
        result is not finite.
    """

    kind: str
    name: str
    pictures: dict[str, Found]
    sensitivities: dict[str, Found]
    codes: dict[str, Found]


def measure_extremes(
    kinds: frozenset[str] | None = None, vtk: bool = True
) -> Iterator[tuple[int, int, Row]]:
    """Measure all extremes, or those of some kinds.

    Yields
    ------
    done, total : int
    row : Row
    """
    chosen = [each for each in extremes() if kinds is None or each.kind in kinds]
    for number, extreme in enumerate(chosen):
        posed = extreme.pose()
        pictures = {n: _found(f, posed) for n, f in PICTURES.items() if vtk or "VTK" not in n}
        sensitivities = {name: _found(f, posed) for name, f in SENSITIVITIES.items()}
        yield (
            number + 1,
            len(chosen),
            Row(extreme.kind, extreme.name, pictures, sensitivities, _codes(extreme, posed)),
        )


def _found(measure: Callable[[Posed], float], posed: Posed) -> Found:
    try:
        return measure(posed)
    except TfscopeError as error:
        return str(error)


def _codes(extreme: Extreme, posed: Posed) -> dict[str, Found]:
    found: dict[str, Found] = {}
    for name, measure in CODES.items():
        if extreme.of_tf if name == "TF codec" else extreme.of_volume:
            found[name] = _found(measure, posed)
    return found


def _error(found: NDArray[np.floating], truth: NDArray[np.floating], relative: bool) -> float:
    """Largest difference, as a share of the largest number of the truth if relative; or NaN."""
    if not (np.isfinite(found).all() and np.isfinite(truth).all()):
        return float("nan")
    largest = float(np.abs(found - truth).max())
    scale = float(np.abs(truth).max()) if relative else 1.0
    return largest / scale if scale > 0 else largest


def _drawn(
    posed: Posed, name: RendererName, lighting: Lighting = "none", preintegrated: bool = False
) -> NDArray[np.float32]:
    with closing(
        open_renderer(name, posed.volume, lighting, preintegrated=preintegrated)
    ) as renderer:
        return renderer.render(posed.inputs, posed.raster)


def _picture(lighting: Lighting) -> Callable[[Posed], float]:
    def measure(posed: Posed) -> float:
        image = _drawn(posed, "raycast", lighting)
        return _error(image, _truth(posed, lighting), relative=True)

    return measure


def _truth(posed: Posed, lighting: Lighting) -> NDArray[np.float64]:
    return reference_light.picture(posed.volume, posed.inputs, posed.raster, DISTANCE, lighting)


def _segments(posed: Posed) -> float:
    image = _drawn(posed, "raycast", preintegrated=True)
    truth = reference_light.preintegrated(posed.volume, posed.inputs, posed.raster, DISTANCE)
    return _error(image, truth, relative=True)


def _vtk(lighting: Lighting) -> Callable[[Posed], float]:
    def measure(posed: Posed) -> float:
        image = _drawn(posed, "vtk", lighting)
        return _error(image, _truth(posed, lighting), relative=False)

    return measure


def _path_opacity(posed: Posed) -> float:
    """Error of the opacity under the usual light; NaN where a colour is not finite, or black."""
    image = _drawn(posed, "raycast", "path")
    if image[..., 3].max() > 0.01 and not image[..., :3].max() > 0:
        return float("nan")
    opacity = _error(image[..., 3], _truth(posed, "none")[..., 3], relative=False)
    return opacity if np.isfinite(image).all() else float("nan")


def _white_furnace(posed: Posed) -> float:
    """Distance of a white medium's colour from its opacity under an even sky, which it equals."""
    from model.rendering.path_tracing.renderer import Lamp, PathTracer

    lamp = Lamp(key=0.0, sky=1.0, surfaces=False, bounces=100_000)
    scalar_range = posed.volume.scalar_range
    white = ColorTF(scalar_range, ((scalar_range[0], 1.0, 1.0, 1.0),))
    tracer = PathTracer(posed.volume, samples=2, lamp=lamp)
    try:
        image = tracer.render(replace(posed.inputs, color_tf=white), posed.raster)
    finally:
        tracer.close()
    return _error(image[..., :3], np.repeat(image[..., 3:], 3, axis=-1), relative=False)


def _edits() -> list[NDArray[np.float64]]:
    bins = np.arange(TF_SAMPLES)
    return [
        np.exp(-0.5 * ((bins - middle) / width) ** 2) if width else (bins == middle).astype(float)
        for middle, width in EDITS
    ]


def _plot(lighting: Lighting) -> Callable[[Posed], float]:
    """Error of the derivative of the picture's squared norm along some edits."""

    def measure(posed: Posed) -> float:
        from model.rendering.raycast.renderer import RaycastRenderer

        renderer = RaycastRenderer(posed.volume, lighting)
        rows, columns = posed.raster.shape
        try:
            window = np.array([[0, rows, 0, columns]])
            gradients, _ = renderer.differentiate(posed.inputs, posed.raster, window)
        finally:
            renderer.close()
        found, truth = [], []
        for number, edit in enumerate(_edits()):
            image, change = _derivative(posed, lighting, number)
            found.append(float(gradients[0] @ edit))
            truth.append(float((image[..., :3] * change[..., :3]).sum()))
        return _error(np.array(found), np.array(truth), relative=True)

    return measure


def _field(lighting: Lighting) -> Callable[[Posed], float]:
    """Error of each pixel's derivative along some edits, the largest of them all."""

    def measure(posed: Posed) -> float:
        from model.rendering.raycast.renderer import RaycastRenderer

        renderer = RaycastRenderer(posed.volume, lighting)
        found, truth = [], []
        try:
            for number, edit in enumerate(_edits()):
                found.append(renderer.change(posed.inputs, posed.raster, edit))
                truth.append(_derivative(posed, lighting, number)[1][..., :3])
        finally:
            renderer.close()
        return _error(np.array(found), np.array(truth), relative=True)

    return measure


@lru_cache(maxsize=16)
def _derivative(
    posed: Posed, lighting: Lighting, number: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    edit = _edits()[number]
    return reference_light.derivative(
        posed.volume, posed.inputs, posed.raster, DISTANCE, lighting, edit
    )


def _compact(bytes_a_voxel: float) -> Callable[[Posed], float]:
    """Largest error of a voxel, as a share of the range; infinite if the grid is not the same."""

    def measure(posed: Posed) -> float:
        from model.volume_files import read_volume
        from model.volume_files.compact import write_compact
        from model.volume_files.voxel_code import encode_voxels

        volume = posed.volume
        most = int(bytes_a_voxel * volume.voxels.size)
        coded = encode_voxels(volume.voxels, most, volume.missing)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "a.tfvolume"
            write_compact(path, volume, coded)
            back = read_volume(path)
        same = (back.spacing, back.origin) == (volume.spacing, volume.origin)
        both = volume.missing, back.missing
        if not same or back.voxels.dtype != volume.voxels.dtype:
            return float("inf")
        if (both[0] is None) != (both[1] is None):
            return float("inf")
        known = np.ones(volume.voxels.shape, bool) if both[0] is None else ~both[0]
        if both[1] is not None and (both[1] == known).any():
            return float("inf")
        lo, hi = volume.data_range
        exact = [each[known].astype(np.longdouble) / 2 for each in (back.voxels, volume.voxels)]
        width = np.longdouble(hi) / 2 - np.longdouble(lo) / 2
        if not np.isfinite(exact[0]).all():
            return float("nan")
        return float(np.abs(exact[0] - exact[1]).max() / width)

    return measure


def _codec(posed: Posed) -> float:
    """Difference of the shipped codec's TF, there and back, between 32 and 64 bits."""
    import torch

    from model.latent.codec_folder import SHIPPED_CODEC, load_codec

    _, network = load_codec(SHIPPED_CODEC)
    precise = copy.deepcopy(network).double()
    tf = torch.from_numpy(2 * posed.inputs.opacity_tf.sample()[None] - 1)
    with torch.no_grad():
        found = network.decode(network.encode(tf)).numpy()
        truth = precise.decode(precise.encode(tf.double())).numpy()
    return _error((found + 1) / 2, (truth + 1) / 2, relative=False)


PICTURES: dict[str, Callable[[Posed], float]] = {
    "unlit": _picture("none"),
    "pre-integrated": _segments,
    "direct": _picture("direct"),
    "soft": _picture("soft"),
    "shadows": _picture("shadows"),
    "VTK unlit": _vtk("none"),
    "VTK direct": _vtk("direct"),
    "VTK shadows": _vtk("shadows"),
    "path-traced opacity": _path_opacity,
    "path-traced light": _white_furnace,
}
"""Columns of pictures: the ray caster's lights, VTK's, and the path tracer's."""

SENSITIVITIES: dict[str, Callable[[Posed], float]] = {
    "plot, unlit": _plot("none"),
    "plot, direct": _plot("direct"),
    "plot, soft": _plot("soft"),
    "plot, shadows": _plot("shadows"),
    "field, unlit": _field("none"),
    "field, direct": _field("direct"),
    "field, soft": _field("soft"),
    "field, shadows": _field("shadows"),
}

CODES: dict[str, Callable[[Posed], float]] = {
    "without loss": _compact(16.0),
    "1 byte a voxel": _compact(1.0),
    "TF codec": _codec,
}
