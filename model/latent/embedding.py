"""Places of latent codes on a plane: principal components, or t-SNE in its own process.

Similar codes are close on the plane; far distances mean little. The process is ``python -m
model.latent.embedding CODES PLACES``.
"""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError, missing
from model.latent.codes import Codes, checked_codes

PERPLEXITY = 30  # effective number of neighbours of t-SNE, as in the paper (section 5.2)
ITERATIONS = 750

LEAST_POINTS = 5  # distinct points below which there is no map
Places = NDArray[np.float32]  # places (n, 2); the longer side of their bounding box is -1..1
Progress = Callable[[float], None]  # called with the finished fraction


class EmbeddingProcess:
    """t-SNE of codes (n, d) in its own process, so that it can be cancelled."""

    def __init__(self, codes: Codes) -> None:
        self._scaled = standardized(codes)
        self._process: subprocess.Popen[str] | None = None
        self._cancelled = False

    def run(self, progress: Progress = lambda done: None) -> Places | None:
        """Compute the map (n, 2) and wait for it; return None if another thread cancels it."""
        if (clause := missing("maps")) is not None:
            raise LatentError(f"The principal components are shown, as for a map {clause}")
        with TemporaryDirectory(prefix="tfscope-map-") as folder:
            source, target = Path(folder) / "codes.npy", Path(folder) / "places.npy"
            np.save(source, self._scaled)
            run = ("-u", "-m", "model.latent.embedding", str(source), str(target))
            command, root = [sys.executable, *run], Path(__file__).parents[2]
            errors = Path(folder) / "errors.txt"
            with errors.open("w") as file:
                self._process = subprocess.Popen(
                    command, stdout=subprocess.PIPE, stderr=file, text=True, cwd=root
                )
            with self._process as process:
                if self._cancelled:
                    process.kill()
                assert process.stdout is not None
                for line in process.stdout:
                    if line.startswith("[t-SNE] Iteration "):
                        progress(int(line.split()[2].rstrip(":")) / ITERATIONS)
                code = process.wait()
            problem = errors.read_text(errors="replace").strip().splitlines()
            if self._cancelled:
                return None
            if code or not target.is_file():
                reason = problem[-1] if problem else f"it ended with code {code}"
                raise LatentError(
                    f"The map cannot be computed ({reason}); the principal components are shown."
                )
            return normalized(np.load(target))

    def cancel(self) -> None:
        """End the process; `run` then returns at once."""
        self._cancelled = True
        if self._process is not None:
            self._process.kill()


def principal_places(codes: Codes) -> Places:
    """Places of codes (n, d) along their two principal axes."""
    scaled = standardized(codes)
    _, _, axes = np.linalg.svd(scaled, full_matrices=False)
    two = np.zeros((2, scaled.shape[1]))
    two[: len(axes[:2])] = axes[:2]
    # A singular vector's sign is arbitrary: the largest component points upwards.
    largest = np.abs(two).argmax(axis=1)
    two *= np.where(two[[0, 1], largest] < 0, -1, 1)[:, None]
    return normalized(scaled @ two.T)


def standardized(codes: Codes) -> NDArray[np.float64]:
    """Codes (n, d) with mean 0 and variance 1, without numbers that hardly vary."""
    values = checked_codes(codes).astype(np.float64)
    deviations = values.std(axis=0)
    scale = np.abs(values).max()
    varies = deviations > 1e-6 * max(scale, 1e-30)
    if varies.any():
        values = (values[:, varies] - values[:, varies].mean(axis=0)) / deviations[varies]
    distinct = len(np.unique(values.round(4), axis=0)) if varies.any() else 1
    if distinct < LEAST_POINTS:
        raise LatentError(
            f"Of {len(codes)} codes only {distinct} differ; a map needs {LEAST_POINTS} at least. "
            "The codec has collapsed, or the samples are too few."
        )
    return values


def normalized(places: NDArray[np.floating]) -> Places:
    """Places centred on their bounding box, the longer side of which becomes -1..1."""
    lowest, highest = places.min(axis=0), places.max(axis=0)
    half = max(float((highest - lowest).max()) / 2, 1e-30)
    return ((places - (lowest + highest) / 2) / half).astype(np.float32)


def main(source: str, target: str) -> None:
    """Compute the map of a `.npy` file of standardized codes (n, d), and write its places."""
    from sklearn.manifold import TSNE

    codes = np.load(source)
    # Own finite start, as scikit-learn's divides by zero for equal points.
    _, _, axes = np.linalg.svd(codes, full_matrices=False)
    start = np.zeros((len(codes), 2))
    start[:, : len(axes[:2])] = codes @ axes[:2].T
    start *= 1e-4 / max(float(start[:, 0].std()), 1e-12)
    if not start[:, 1].any():
        start[:, 1] = np.random.default_rng(0).normal(0, 1e-6, len(codes))
    tsne = TSNE(
        perplexity=min(PERPLEXITY, (len(codes) - 1) / 3),
        init=start.astype(np.float32),
        max_iter=ITERATIONS,
        random_state=0,
        verbose=2,
        n_jobs=-1,
    )
    np.save(target, tsne.fit_transform(codes.astype(np.float32)))


if __name__ == "__main__":
    main(*sys.argv[1:])
