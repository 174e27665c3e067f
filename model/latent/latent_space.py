"""A latent space: a codec, the range of its TFs, and the files of its map."""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError, os_errors_as
from model.files import cache_folder, write_atomically
from model.latent.codes import (
    SAMPLES,
    SAMPLING_SEED,
    SHIPPED_CODEC,
    Codes,
    NetworkCodec,
    TFCodec,
    load_codec,
    sample_codes,
    samples_of,
)
from model.latent.embedding import ITERATIONS, PERPLEXITY, Places, principal_places
from model.latent.latent_map import Cells, LatentMap
from model.samples.sampling import draw_opacity_tfs
from model.scene.scene import Scene
from model.scene.transfer_function import TF_SAMPLES, OpacityTF, Range, check_range
from model.scene.value_scale import ValueScale


@dataclass(frozen=True)
class TFFrame:
    """Stretches a codec's TFs over [0, 1] to a scalar window within the volume's range.

    Below the window, in the background, a stretched TF is 0; above it, the last opacity continues.
    Raises :class:`TransferFunctionError` for a window that is not increasing.
    """

    scalar_range: Range
    window: Range
    scale: ValueScale = "linear"

    def __post_init__(self) -> None:
        check_range(self.window)

    def opacity_tf(self, opacities: NDArray[np.floating]) -> OpacityTF:
        """Return the TF of 256 opacities over the window, which are clipped to [0, 1]."""
        values = np.linspace(*self.window, TF_SAMPLES)
        points = [*zip(values.tolist(), np.clip(opacities, 0, 1).tolist(), strict=True)]
        if self.window[0] > self.scalar_range[0]:
            points.insert(0, (points[0][0], 0.0))
        return OpacityTF(self.scalar_range, points=tuple(points), scale=self.scale)

    def stretched(self, opacities: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return TFs (n, 256) over the window as TFs (n, 256) over the scalar range."""
        lo, hi = self.window
        values = np.linspace(*self.scalar_range, TF_SAMPLES)
        place = np.clip((values - lo) / (hi - lo), 0, 1) * (TF_SAMPLES - 1)
        below = np.minimum(place.astype(np.int64), TF_SAMPLES - 2)
        share = (place - below).astype(np.float32)
        between = opacities[:, below] * (1 - share) + opacities[:, below + 1] * share
        return np.where(values >= lo, between, 0).astype(np.float32)


KNOWN_TFS = 4000  # random TFs whose codes determine the sampled box

UNIT_SCENE = Scene("any volume", "", (0.0, 1.0), (0.0, 1.0), image_size=16)
"""Scene of the shipped codec's training TFs: the family "drawn" over [0, 1]."""


@dataclass(frozen=True, eq=False)
class LatentSpace:
    """A codec of one volume's opacity TFs."""

    codec: TFCodec
    frame: TFFrame
    scene: Scene  # of its random TFs
    digest: str  # SHA-256 of its weights
    folders: tuple[Path, ...]  # possible files of its map; the last one is written

    @classmethod
    def shipped(
        cls, scalar_range: Range, window: Range, scale: ValueScale = "linear"
    ) -> LatentSpace:
        """Return the space of the shipped codec, stretched to a volume's scalar window."""
        digest, codec = load_codec()
        frame = TFFrame(scalar_range, window, scale)
        return cls(codec, frame, UNIT_SCENE, digest, (SHIPPED_CODEC, _cache(digest)))

    @classmethod
    def of_model(cls, folder: Path) -> LatentSpace:
        """Return the space of a model's codec, over the whole scalar range of its volume."""
        from model.networks.card import read_header
        from model.networks.checkpoint import load_model

        card, network = load_model(folder)
        digest = str(read_header(folder).get("sha256", ""))
        frame = TFFrame(card.scene.scalar_range, card.scene.scalar_range, card.scene.scale)
        codec = NetworkCodec(network.codec)
        return cls(codec, frame, card.scene, digest, (folder, _cache(digest)))

    def tf_of(self, code: Codes) -> OpacityTF:
        """Return the opacity TF, with 256 points or one more, of a code (d,)."""
        return self.tfs_of(code[None])[0]

    def tfs_of(self, codes: Codes) -> list[OpacityTF]:
        """Return the opacity TFs of codes (n, d)."""
        return [self.frame.opacity_tf(opacities) for opacities in self.codec.decode(codes)]

    def code_of(self, opacity_tf: OpacityTF) -> Codes:
        """Return the code (d,) that is nearest to an opacity TF within the window."""
        return self.codec.encode(opacity_tf.sample(self.frame.window)[None])[0]

    def open_map(self, count: int = SAMPLES) -> LatentMap:
        """Return the stored map; without one, new samples along their principal axes."""
        key = map_key(self.digest, count)
        numbers = self.codec.encode(np.zeros((1, TF_SAMPLES), np.float32)).shape[1]
        for folder in self.folders:
            try:
                codes, places = load_map(folder / _file_name(count, key), key)
                if codes.shape[1] == numbers:
                    return LatentMap(samples_of(self.codec, codes), places, is_final=True)
            except LatentError:
                # Missing or foreign: try the next one.
                continue
        known = draw_opacity_tfs(self.scene, SAMPLING_SEED, 0, KNOWN_TFS)
        samples = sample_codes(self.codec, known, count)
        return LatentMap(samples, principal_places(samples.codes), is_final=False)

    def keep_map(self, codes: Codes, places: Places) -> None:
        """Store a finished map; raise :class:`LatentError` if that fails."""
        key = map_key(self.digest, len(codes))
        save_map(self.folders[-1] / _file_name(len(codes), key), key, codes, places)


def _file_name(count: int, key: str) -> str:
    """Return a map's file name, which depends on the number of samples."""
    return MAP_FILE if count == SAMPLES else f"map-{key[:16]}.npz"


def _cache(digest: str) -> Path:
    return cache_folder() / "maps" / digest[:16]


MAP_FILE = "map.npz"
FORMAT = 1


def map_key(codec_digest: str, count: int = SAMPLES) -> str:
    """Key of the map of a codec by its weights' SHA-256, whatever the libraries' versions."""
    facts = [FORMAT, codec_digest, count, SAMPLING_SEED, PERPLEXITY, ITERATIONS]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def save_map(path: Path, key: str, codes: Codes, places: Places) -> None:
    """Write the codes (n, d) and places (n, 2) of a map, in half precision."""
    import sklearn

    versions = json.dumps({"scikit-learn": sklearn.__version__, "numpy": np.__version__})
    content, half = io.BytesIO(), np.float16
    about: Any = {"key": np.array(key), "versions": np.array(versions)}
    np.savez_compressed(content, **about, codes=codes.astype(half), places=places.astype(half))
    remedy = "it will be computed again next time"
    with os_errors_as(LatentError, f"{path}: the map cannot be written", remedy):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_atomically(path, content.getvalue())


def load_map(path: Path, key: str) -> tuple[Codes, Places]:
    """Read the stored codes (n, d) and places (n, 2) of a map."""
    with os_errors_as(LatentError, f"{path}: the map cannot be read"):
        content = path.read_bytes()
    try:
        with np.load(io.BytesIO(content), allow_pickle=False) as stored:
            found = str(stored["key"])
            codes = stored["codes"].astype(np.float32)
            places = stored["places"].astype(np.float32)
    except (ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise LatentError(f"{path}: the file is not a map, or is damaged ({error}).") from error
    if found != key:
        raise LatentError(f"{path}: the map belongs to another codec.")
    fits = codes.ndim == 2 and places.shape == (len(codes), 2) and len(codes) > 0
    if not (fits and np.isfinite(codes).all() and np.isfinite(places).all()):
        raise LatentError(f"{path}: the map is damaged: codes {codes.shape}, {places.shape}.")
    return codes, places


Images = NDArray[np.float32]


def draw_cells(cells: Cells, draw: Callable[[Codes], Images]) -> Images:
    """Draw a brushed rectangle's cells (4, 4, S, S, 4) by codes (n, d), NaN in empty ones."""
    filled = cells.count > 0
    drawn = draw(cells.codes[filled])
    images = np.full((*filled.shape, *drawn.shape[1:]), np.nan, dtype=np.float32)
    images[filled] = drawn
    return images
