"""Training pairs of the network behind the denoiser: pictures of few samples and of many.

Volumes alternate, with one block of pairs each; a block is a file, and is drawn once, as its
random numbers depend only on seed, volume and block. Finished blocks stay after an interruption.
"""

import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import DatasetError, os_errors_as
from model.files import write_atomically
from model.rendering.path_tracing.denoising import available, denoise
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.rendering.raycast.illumination import LEARNED_SHADOW
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.crop import CropBox
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs, draw_inputs
from model.scene.scene import Scene
from model.scene.volume import Volume

FEW = (1, 2, 4)  # samples of each pixel of the network's inputs
BLOCK = 8  # pairs in a file
SIZE = 128  # width and height of the pictures in pixels

LARGEST = 3
"""Largest scale of pictures from which parts are taken: these have larger and smoother structures
than small pictures."""

MANY = 64
"""Samples of each pixel of the target. It has noise, which no network can learn, but not the bias
of a denoised picture."""

FIRST_TF_SHARE, CROP_SHARE = 0.25, 0.15  # shares of pairs with a volume's first TF, and with a crop
LEAST_OPACITY = 0.04  # least mean opacity of a pair's picture
BRIGHTEST = 8.0  # largest radiance of single pixels that is kept
FIELDS = ("unlit", "soft", "opacity", "denoised", "traced", "exact")


@dataclass(frozen=True, eq=False)
class Pairs:
    """Pairs of one volume, float16, radiance and colours times opacity, channels before pixels.

    Images are (N, 3, h, w), the opacity (N, 1, h, w); `denoised` and `traced` have one image for
    each number of samples in :data:`FEW`. `exact` has many other samples, not denoised, and `error`
    is its standard error.
    """

    unlit: NDArray[np.float16]
    soft: NDArray[np.float16]
    opacity: NDArray[np.float16]
    denoised: NDArray[np.float16]
    traced: NDArray[np.float16]
    exact: NDArray[np.float16]
    error: NDArray[np.float64]


class PairDrawer:
    """Draws pairs of one volume."""

    def __init__(self, volume: Volume, many: int = MANY) -> None:
        self._volume, self._many = volume, many
        self._scene = Scene.of(volume, SIZE, "path", renderer="raycast", movable_light=True)
        self._lit = RaycastRenderer(volume, "soft", shadow=LEARNED_SHADOW)

    def block(self, seed: int, number: int) -> Pairs | None:
        """Draw the pairs of a block; None if too little of the volume is visible."""
        rng = np.random.default_rng([seed, number])
        few = PathTracer(self._volume, seed=2 * number + 1)
        many = PathTracer(self._volume, seed=2 * number + 2)
        found: list[dict[str, Any]] = []
        # Many random TFs show almost nothing.
        for _ in range(8 * BLOCK):
            drawn = self._pair(self._inputs(rng), self._part(rng), few, many)
            if drawn is not None:
                found.append(drawn)
            if len(found) == BLOCK:
                break
        few.close()
        many.close()
        if not found:
            return None
        arrays = {
            name: np.stack([pair[name] for pair in found]).astype(np.float16) for name in FIELDS
        }
        return Pairs(**arrays, error=np.array([pair["error"] for pair in found]))

    def close(self) -> None:
        """End the threads."""
        self._lit.close()

    def _inputs(self, rng: np.random.Generator) -> SceneInputs:
        inputs = draw_inputs(rng, self._scene)
        if rng.random() < FIRST_TF_SHARE:
            first = default_transfer_function(self._volume)
            inputs = replace(inputs, opacity_tf=first.opacity)
            if rng.random() < 0.5:
                inputs = replace(inputs, color_tf=first.color)
        if rng.random() < CROP_SHARE:
            (x0, y0, z0), (x1, y1, z1) = rng.uniform((0, 0.6), (0.4, 1), (3, 2)).T.tolist()
            inputs = replace(inputs, crop=CropBox((x0, y0, z0), (x1, y1, z1)))
        return inputs

    def _part(self, rng: np.random.Generator) -> Raster:
        """Draw a part of a larger picture."""
        scale = int(rng.integers(LARGEST)) + 1
        left, top = rng.integers((scale - 1) * SIZE + 1, size=2).tolist()
        whole = scale * SIZE
        return Raster(whole, whole, left, top, SIZE, SIZE)

    def _pair(
        self, inputs: SceneInputs, part: Raster, few: PathTracer, many: PathTracer
    ) -> dict[str, Any] | None:
        estimates = list(few.refine(inputs, part, FEW[-1]))
        unlit = estimates[0]
        if unlit.rgba[..., 3].mean() < LEAST_OPACITY:
            return None
        *_, exact = many.refine(inputs, part, self._many)
        kept = [estimate for estimate in estimates if estimate.samples in FEW]
        return {
            "unlit": _first(unlit.albedo),
            "soft": _first(self._lit.render(inputs, part)[..., :3]),
            "opacity": _first(unlit.rgba[..., 3:]),
            "denoised": np.stack([_first(denoise(e.radiance, e.albedo)) for e in kept]),
            "traced": np.stack([_first(e.radiance) for e in kept]),
            "exact": _first(exact.radiance),
            "error": exact.error,
        }


def write_pairs(
    folder: Path, volumes: Sequence[Volume], blocks: int, seed: int = 0, many: int = MANY
) -> Iterator[Path]:
    """Draw blocks of pairs of each volume in turn, and yield the file of each."""
    if not available():
        raise DatasetError("Pairs need Open Image Denoise; install the package pyoidn.")
    drawers = [PairDrawer(volume, many) for volume in volumes]
    try:
        with os_errors_as(DatasetError, f"{folder}: pairs cannot be written"):
            folder.mkdir(parents=True, exist_ok=True)
            both = [*zip(volumes, drawers, strict=True)]
            for number, (volume, drawer) in product(range(blocks), both):
                path = folder / f"{volume.fingerprint[:12]}-{seed}-{number:04d}.npz"
                pairs = None if path.exists() else drawer.block(seed, number)
                if pairs is not None:
                    write_block(path, pairs)
                    yield path
    finally:
        for drawer in drawers:
            drawer.close()


def write_block(path: Path, pairs: Pairs) -> None:
    """Write a block of pairs atomically."""
    content = BytesIO()
    np.savez(content, **vars(pairs))
    write_atomically(path, content.getvalue())


def read_pairs(folder: Path) -> dict[str, Pairs]:
    """Read all pairs of a folder, by the first digits of their volume's fingerprint."""
    found: dict[str, list[dict[str, Any]]] = {}
    for path in sorted(folder.glob("*-*-*.npz")):
        try:
            with path.open("rb") as content, np.load(content, allow_pickle=False) as file:
                arrays = {name: file[name] for name in (*FIELDS, "error")}
        except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
            raise DatasetError(
                f"{path}: the pairs are damaged, or of an older version ({error}); "
                "delete the file, and draw them anew."
            ) from error
        found.setdefault(path.name.split("-")[0], []).append(arrays)
    if not found:
        raise DatasetError(f"{folder}: there are no pairs here; draw some with 'light pairs'.")
    return {
        name: Pairs(**{key: np.concatenate([block[key] for block in blocks]) for key in blocks[0]})
        for name, blocks in found.items()
    }


def _first(image: NDArray[Any]) -> NDArray[np.float32]:
    """Return an image (h, w, channels) as (channels, h, w), limited."""
    return np.moveaxis(np.clip(image, 0, BRIGHTEST), -1, 0)
