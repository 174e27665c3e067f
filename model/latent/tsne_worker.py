"""Process that computes a t-SNE map: ``python -m model.latent.tsne_worker IN OUT SEED``.

IN and OUT are `.npy` files of standardized codes (n, d) and of places (n, 2). scikit-learn
prints its progress every 50 iterations.
"""

from __future__ import annotations

import sys

import numpy as np
from sklearn.manifold import TSNE

from model.latent.embedding import ITERATIONS, PERPLEXITY


def main(source: str, target: str, seed: str) -> None:
    """Compute the map of the codes in a file, and write it into another."""
    codes = np.load(source)
    # A finite start of tiny spread: with equal points, scikit-learn's own divides by zero.
    _, _, axes = np.linalg.svd(codes, full_matrices=False)
    start = np.zeros((len(codes), 2))
    start[:, : len(axes[:2])] = codes @ axes[:2].T
    start *= 1e-4 / max(float(start[:, 0].std()), 1e-12)
    if not start[:, 1].any():
        start[:, 1] = np.random.default_rng(int(seed)).normal(0, 1e-6, len(codes))
    tsne = TSNE(
        perplexity=min(PERPLEXITY, (len(codes) - 1) / 3),
        init=start.astype(np.float32),
        max_iter=ITERATIONS,
        random_state=int(seed),
        verbose=2,
        n_jobs=-1,
    )
    np.save(target, tsne.fit_transform(codes.astype(np.float32)))


if __name__ == "__main__":
    main(*sys.argv[1:])
