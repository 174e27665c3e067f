"""Search for the code whose picture comes nearest to a wish: Gauss-Newton in the code.

An engine only has to draw pictures: derivatives by the code's few numbers are differences of
as many pictures, drawn in one batch. The search asks for batches and is told their pictures,
so that it can run in a loop or beside a window, and be left at any time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from model.errors import LatentError
from model.latent.codes import Codes
from model.scene.region import Mask

Wish = Literal["more", "less"]

WISHED_SHARE = 0.4
"""Share by which "more" and "less" move a region's opacity towards 1 and 0."""

KEPT_WEIGHT = 0.2
"""Weight of what shall stay as it is, beside the region that shall change."""

CANDIDATES = 24
"""Codes whose pictures are compared before the search starts."""

STARTS = 3
"""Candidates from which the search starts, the best first, while the goal is not reached."""

DAMPINGS = (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)
"""Steps are tried with each of these, relative to the diagonal (Levenberg, Marquardt)."""

DIFFERENCE = 0.03
"""Change of a code's number for a derivative, in its standard deviations."""

SEARCH_SIZE = 64
"""Width and height in pixels at which pictures are compared."""

MOST_STEPS = 12
REACHED_RMSE = 0.002
LEAST_GAIN = 0.01
"""Relative gain below which a search from one start ends."""

Images = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Goal:
    """A wished picture, and where it matters.

    Attributes
    ----------
    picture : ndarray of float32, shape (S, S, 4)
        RGBA in [0, 1], premultiplied.
    weights : ndarray of float32, shape (S, S, 4)
        Of each pixel and channel, from 0.
    """

    picture: Images
    weights: NDArray[np.float32]

    def __post_init__(self) -> None:
        if self.picture.shape != self.weights.shape or self.picture.shape[2:] != (4,):
            raise LatentError(
                f"A goal's picture {self.picture.shape} and weights {self.weights.shape} differ."
            )
        if not np.isfinite(self.picture).all():
            raise LatentError("The goal's picture holds numbers that are not finite.")
        if not self.weights.any():
            raise LatentError("The goal's region is empty: draw one that covers some pixels.")

    @classmethod
    def like(cls, picture: Images, mask: Mask | None = None) -> Goal:
        """Return the goal of a picture, or of a region as it is in that picture."""
        weights = np.ones(picture.shape, dtype=np.float32)
        return cls(picture, weights if mask is None else weights * mask[..., None])

    @classmethod
    def of_wish(cls, wish: Wish, picture: Images, mask: Mask) -> Goal:
        """Return the goal of more or less in a region of a picture, and the rest as it is."""
        weights = np.full(picture.shape, KEPT_WEIGHT, dtype=np.float32)
        weights[mask] = 0, 0, 0, 1
        towards = 1.0 if wish == "more" else 0.0
        wished = picture.copy()
        wished[mask, 3] += WISHED_SHARE * (towards - wished[mask, 3])
        return replace(cls.like(wished, mask), weights=weights)

    def errors(self, images: Images) -> NDArray[np.float64]:
        """Weighted RMSE (n,) of pictures (n, S, S, 4)."""
        squares = self.weights * np.square(images.astype(np.float64) - self.picture)
        return np.asarray(np.sqrt(squares.sum(axis=(1, 2, 3)) / self.weights.sum()))

    def residuals(self, images: Images) -> NDArray[np.float64]:
        """Weighted differences (n, 4 S^2) of pictures (n, S, S, 4)."""
        differences = np.sqrt(self.weights) * (images.astype(np.float64) - self.picture)
        return np.asarray(differences.reshape(len(images), -1))


@dataclass(frozen=True, eq=False)
class Found:
    """Nearest code so far, its picture, and the weighted RMSE of that."""

    code: Codes
    picture: Images
    error: float


class GoalSearch:
    """Asks for pictures of codes until one of them comes near the goal.

    Parameters
    ----------
    candidates : ndarray, shape (m, d)
        Codes to compare first; the present TF's should be among them.
    codes : ndarray, shape (n, d)
        Samples of codes: their box bounds the search, their deviations are its unit.

    Attributes
    ----------
    found : Found or None
        None until the first answer.
    question : ndarray of float32, shape (k, d)
        Codes whose pictures are wanted; none when the search has ended.
    """

    def __init__(self, goal: Goal, candidates: NDArray[np.floating], codes: Codes) -> None:
        self._goal = goal
        self._lowest, self._highest = codes.min(axis=0), codes.max(axis=0)
        self._deviations = np.maximum(codes.std(axis=0), 1e-6)
        self._starts: list[Found] = []
        self._present: Found | None = None
        self._jacobian: NDArray[np.float64] | None = None
        self._steps = 0
        self.found: Found | None = None
        self.question: Codes = self._clipped(candidates)

    @property
    def is_done(self) -> bool:
        """True when nothing more is asked for."""
        return not len(self.question)

    def answer(self, images: Images) -> None:
        """Take the pictures (k, S, S, 4) of the codes that were asked for.

        Raises
        ------
        LatentError
            When there are more or fewer pictures, or of another size than the goal's.
        """
        wanted = (len(self.question), *self._goal.picture.shape)
        if images.shape != wanted:
            raise LatentError(f"Pictures of shape {images.shape} do not answer for {wanted}.")
        errors = self._goal.errors(images)
        made = [Found(*one) for one in zip(self.question, images, errors.tolist(), strict=True)]
        made.sort(key=lambda one: one.error)
        if self.found is None or made[0].error < self.found.error:
            self.found = made[0]
        if self._present is None:
            self._starts = made[:STARTS]
            self._start_next()
        elif self._jacobian is None:
            self._jacobian = self._slopes(images)
            self.question = self._trials()
        else:
            self._step_to(made[0])

    def _start_next(self) -> None:
        """Start from the next candidate; end the search without any, or at the goal."""
        assert self.found is not None
        reached = self.found.error < REACHED_RMSE
        if not self._starts or reached:
            self.question = self.question[:0]
            return
        self._present = self._starts.pop(0)
        self._steps = 0
        self._ask_slopes()

    def _ask_slopes(self) -> None:
        self._jacobian = None
        self.question = self._clipped(self._present_code + np.diag(self._offsets))

    @property
    def _present_code(self) -> Codes:
        assert self._present is not None
        return self._present.code

    @property
    def _offsets(self) -> NDArray[np.float32]:
        """Change of each number for a derivative, away from the nearer side of the box."""
        upwards = self._present_code < (self._lowest + self._highest) / 2
        return DIFFERENCE * self._deviations * np.where(upwards, 1, -1).astype(np.float32)

    def _slopes(self, images: Images) -> NDArray[np.float64]:
        """Derivatives (4 S^2, d) of the residuals, per standard deviation of each number."""
        assert self._present is not None
        base = self._goal.residuals(self._present.picture[None])
        changes = self._goal.residuals(images) - base
        # The box may have cut the offsets short, or left nothing of them.
        taken = np.diag(self.question - self._present_code).astype(np.float64) / self._deviations
        shares = np.divide(1.0, taken, out=np.zeros_like(taken), where=np.abs(taken) > 1e-9)
        return np.asarray((changes * shares[:, None]).T)

    def _trials(self) -> Codes:
        """Steps of Gauss and Newton with several dampings."""
        assert self._present is not None and self._jacobian is not None
        residual = self._goal.residuals(self._present.picture[None])[0]
        normal = self._jacobian.T @ self._jacobian
        slope = self._jacobian.T @ residual
        # A number without effect must not make the equations singular.
        diagonal = np.diag(normal) + 1e-9 * max(float(np.trace(normal)), 1e-9)
        steps = [
            -np.linalg.solve(normal + np.diag(damping * diagonal + 1e-12), slope)
            for damping in DAMPINGS
        ]
        return self._clipped(self._present_code + np.stack(steps) * self._deviations)

    def _step_to(self, best: Found) -> None:
        assert self._present is not None
        gain = 1 - best.error / max(self._present.error, 1e-30)
        if best.error < self._present.error:
            self._present = best
        self._steps += 1
        if gain < LEAST_GAIN or best.error < REACHED_RMSE or self._steps == MOST_STEPS:
            self._start_next()
        else:
            self._ask_slopes()

    def _clipped(self, codes: NDArray[np.floating]) -> Codes:
        return np.clip(codes, self._lowest, self._highest).astype(np.float32)


def candidates_for(
    goal: Goal,
    present: NDArray[np.floating] | None,
    codes: Codes,
    opacity_images: NDArray[np.float32],
) -> Codes:
    """Codes to start a search from: the present one, and those that look most like the goal.

    Parameters
    ----------
    present : ndarray, shape (d,), or None
        Code of the present TF.
    codes : ndarray of float32, shape (n, d)
    opacity_images : ndarray of float32, shape (n, size^2)
        Small images of the codes' opacity in the goal's view.
    """
    size = round(opacity_images.shape[1] ** 0.5)
    weights = _shrunk(goal.weights[..., 3], size)
    wished = _shrunk(goal.picture[..., 3] * goal.weights[..., 3], size) / np.maximum(weights, 1e-9)
    errors = (np.square(opacity_images - wished) * weights).sum(axis=1)
    if not weights.any():
        errors = np.random.default_rng(0).permutation(len(codes)).astype(np.float64)
    best = codes[np.argsort(errors)[: CANDIDATES - 1]]
    return best if present is None else np.concatenate([np.atleast_2d(present), best])


def _shrunk(values: NDArray[np.float32], size: int) -> NDArray[np.float64]:
    """Means of an image's parts: (size^2,) of (S, S)."""
    edges = np.linspace(0, len(values), size + 1).round().astype(np.int64)[:-1]
    edges = np.minimum(edges, len(values) - 1)
    counts = np.diff([*edges, len(values)]).clip(min=1)
    sums = np.add.reduceat(np.add.reduceat(values.astype(np.float64), edges, 0), edges, 1)
    return np.asarray((sums / np.outer(counts, counts)).reshape(-1))
