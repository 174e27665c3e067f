"""Quality of a codec for browsing: true, smooth, well spread, without folds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from model.latent.codes import TFCodec, sample_codes
from model.samples.sampling import draw_opacity_tfs
from model.training.codec_training import UNIT_SCENE, CodecDesign, train_codec

CHECKED_SEED = 0x7F5C
"""Seed of the TFs that codecs are measured on, unlikely to be used for training."""

CHECKED, KNOWN, RANDOM, PAIRS = 3000, 20_000, 2000, 600
LAYERS = (1, 16)
STEPS = 32
NEIGHBOURS = 15
FAINT = 0.05


@dataclass(frozen=True)
class BrowsingRow:
    """Measurements of a codec, on TFs of the family "drawn" not used for training.

    Attributes
    ----------
    name : str
        Kind of the codec.
    steps : int
        Number of training steps.
    layer_rmse : dict of int to float
        True: RMSE of the opacity (0..1) of homogeneous layers over TFs and scalar values, by
        thickness in voxels.
    faint_rmse : float
        The same for layers of 16 voxels where the TF is below .05 but not 0.
    detour : float
        Smooth: length of the TFs' path along a straight line in the code, over the distance of
        its ends; median over pairs of TFs.
    jump : float
        Largest of 32 steps along it, over their mean; median.
    plausible : float
        Well spread: distance of random codes' TFs from the nearest of 20,000 drawn TFs, over
        that of drawn TFs; medians.
    nothing : float
        Share of random codes whose TF is below .01 everywhere.
    returned : float
        No fold: RMS change of random codes when decoded and encoded, in standard deviations.
    neighbours : float
        Share of the 15 nearest TFs that are among the 15 nearest codes.
    dimension : float
        Effective dimension of the map's samples.
    """

    name: str
    latent_dim: int
    steps: int
    layer_rmse: dict[int, float]
    faint_rmse: float
    detour: float
    jump: float
    plausible: float
    nothing: float
    returned: float
    neighbours: float
    dimension: float


def compare_designs(
    designs: dict[str, CodecDesign], steps: int, seed: int = 0
) -> Iterator[BrowsingRow]:
    """Train codecs for as many steps each, and measure them."""
    for name, design in designs.items():
        for _, codec in train_codec(design, steps, seed, reports=1):
            codec.eval()
            yield measure_browsing(name, TFCodec(codec), steps)


def measure_browsing(name: str, codec: TFCodec, steps: int) -> BrowsingRow:
    """Measure a codec of TFs over [0, 1]."""
    from sklearn.neighbors import NearestNeighbors

    tfs = draw_opacity_tfs(UNIT_SCENE, CHECKED_SEED, 0, CHECKED)
    known = draw_opacity_tfs(UNIT_SCENE, CHECKED_SEED, 1, KNOWN)
    codes = codec.encode(tfs)
    decoded = codec.decode(codes)
    is_faint = (tfs > 0) & (tfs < FAINT)
    thick = np.square(_layer(decoded, 16) - _layer(tfs, 16))
    lengths, jumps = _paths(codec, codes)
    rng = np.random.default_rng(0)
    lowest, highest = np.quantile(codes, [0.005, 0.995], axis=0)
    drawn = rng.uniform(lowest, highest, (RANDOM, codes.shape[1])).astype(np.float32)
    random = codec.decode(drawn)
    back = codec.encode(random)
    search = NearestNeighbors(n_neighbors=1).fit(_seen(known))
    usual, far = (
        np.median(search.kneighbors(_seen(some))[0]) for some in (tfs[:RANDOM], codec.decode(back))
    )
    near_codes, near_tfs = (
        NearestNeighbors(n_neighbors=NEIGHBOURS).fit(x).kneighbors(return_distance=False)
        for x in (codes, _seen(tfs))
    )
    shared = [len({*a} & {*b}) for a, b in zip(near_codes, near_tfs, strict=True)]
    return BrowsingRow(
        name,
        codes.shape[1],
        steps,
        {n: float(np.sqrt(np.square(_layer(decoded, n) - _layer(tfs, n)).mean())) for n in LAYERS},
        float(np.sqrt(thick[is_faint].mean())),
        float(np.median(lengths)),
        float(np.median(jumps)),
        float(far / usual),
        float((random.max(axis=1) < 0.01).mean()),
        float(np.sqrt(np.square((back - drawn) / codes.std(axis=0)).mean())),
        float(np.mean(shared) / NEIGHBOURS),
        sample_codes(codec, tfs, RANDOM).effective_dimension,
    )


def _paths(
    codec: TFCodec, codes: NDArray[np.float32]
) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Relative length, and largest over mean step, of paths between pairs of codes."""
    one, other = codes[:PAIRS], codes[PAIRS : 2 * PAIRS]
    stations = [one + (other - one) * t for t in np.linspace(0, 1, STEPS + 1)]
    path = np.stack([_seen(codec.decode(codes)) for codes in stations])
    steps = np.linalg.norm(np.diff(path, axis=0), axis=2)
    direct = np.linalg.norm(path[-1] - path[0], axis=1)
    length = steps.sum(axis=0)
    return length / np.maximum(direct, 1e-6), steps.max(axis=0) * STEPS / np.maximum(length, 1e-9)


def _seen(tfs: NDArray[np.floating]) -> NDArray[np.float64]:
    """TFs as images show them: opacities of thin and of thick layers, at every fourth bin."""
    return np.concatenate([tfs, _layer(tfs, 16)], axis=1)[:, ::4]


def _layer(tfs: NDArray[np.floating], voxels: int) -> NDArray[np.float64]:
    """Opacity of homogeneous layers."""
    return 1 - (1 - tfs.astype(np.float64)) ** voxels
