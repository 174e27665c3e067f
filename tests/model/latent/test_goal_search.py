from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from blobs import blobs
from toy_codec import ToyCodec

from model.errors import LatentError
from model.latent.goal_search import (
    DAMPINGS,
    Goal,
    GoalSearch,
    candidates_for,
)
from model.latent.latent_space import LatentSpace
from model.latent.opacity_overview import RayLengths
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.inputs import SceneInputs
from model.scene.scene import Scene

SIZE = 12
Draw = Callable[[np.ndarray], np.ndarray]


def draw(codes: np.ndarray) -> np.ndarray:
    """Pictures whose pixels depend on both numbers of a code, and not linearly."""
    y, x = np.mgrid[0:SIZE, 0:SIZE] / SIZE
    a, b = codes.astype(np.float64).T[:, :, None, None]
    values = np.exp(-((x - 0.5 - 0.4 * a) ** 2 + (y - 0.5) ** 2) / (0.15 + 0.1 * b))
    return np.repeat(values[..., None], 4, axis=3).astype(np.float32)


def run(search: GoalSearch, draw: Draw = draw) -> int:
    batches = 0
    while not search.is_done:
        search.answer(draw(search.question))
        batches += 1
        assert batches < 200
    return batches


@pytest.fixture
def codes() -> np.ndarray:
    return np.random.default_rng(0).uniform(-1, 1, (200, 2)).astype(np.float32)


def test_a_picture_is_found_again(codes: np.ndarray) -> None:
    for wanted in ((0.3, -0.5), (-0.8, 0.9)):
        goal = Goal.like(draw(np.array([wanted]))[0])
        search = GoalSearch(goal, codes[:5], codes)
        run(search)
        assert search.found is not None
        assert search.found.error < 0.003
        assert search.found.code == pytest.approx(wanted, abs=0.03)
        assert search.found.picture == pytest.approx(draw(search.found.code[None])[0])


def test_the_error_never_rises_and_is_that_of_the_picture(codes: np.ndarray) -> None:
    goal = Goal.like(draw(np.array([[0.1, 0.1]]))[0])
    search = GoalSearch(goal, codes[:3], codes)
    errors = []
    while not search.is_done:
        search.answer(draw(search.question))
        assert search.found is not None
        difference = search.found.picture.astype(np.float64) - goal.picture
        assert search.found.error == pytest.approx(np.sqrt(np.square(difference).mean()))
        errors.append(search.found.error)
    assert errors == sorted(errors, reverse=True)


def test_the_first_step_is_that_of_gauss_and_newton(codes: np.ndarray) -> None:
    """For pictures that are linear in the code the least damped step arrives at once."""
    maps = np.random.default_rng(1).normal(size=(2, SIZE, SIZE, 4)) / 10

    def linear(some: np.ndarray) -> np.ndarray:
        return (0.5 + np.tensordot(some.astype(np.float64), maps, 1)).astype(np.float32)

    goal = Goal.like(linear(np.array([[0.4, -0.2]]))[0])
    search = GoalSearch(goal, codes[:1], codes)
    search.answer(linear(search.question))
    assert len(search.question) == 2
    search.answer(linear(search.question))
    assert len(search.question) == len(DAMPINGS)
    assert search.question[0] == pytest.approx([0.4, -0.2], abs=1e-3)


def test_a_region_is_all_that_matters_of_a_picture(codes: np.ndarray) -> None:
    mask = np.zeros((SIZE, SIZE), dtype=bool)
    mask[:, : SIZE // 2] = True
    picture = draw(np.array([[-0.5, 0.0]]))[0]
    picture[:, SIZE // 2 :] = 1.0
    search = GoalSearch(Goal.like(picture, mask), codes[:5], codes)
    run(search)
    assert search.found is not None
    assert search.found.code[0] == pytest.approx(-0.5, abs=0.05)


def test_more_and_less_change_the_region(codes: np.ndarray) -> None:
    before = draw(np.array([[0.0, 0.0]]))[0]
    mask = np.zeros((SIZE, SIZE), dtype=bool)
    mask[4:8, 9:] = True
    for wish, sign in (("more", 1), ("less", -1)):
        goal = Goal.of_wish(wish, before, mask)  # type: ignore[arg-type]
        search = GoalSearch(goal, np.zeros((1, 2)), codes)
        run(search)
        assert search.found is not None
        after = search.found.picture
        assert sign * (after[mask, 3].mean() - before[mask, 3].mean()) > 0.02


def test_numbers_without_any_effect_do_no_harm(codes: np.ndarray) -> None:
    flat = np.full((1, SIZE, SIZE, 4), 0.5, dtype=np.float32)
    search = GoalSearch(Goal.like(flat[0] * 0), codes[:4], codes)
    run(search, lambda some: np.repeat(flat, len(some), axis=0))
    assert search.found is not None
    assert search.found.error == pytest.approx(0.5)


def test_goals_of_nonsense_are_refused() -> None:
    picture = np.zeros((SIZE, SIZE, 4), dtype=np.float32)
    with pytest.raises(LatentError, match="empty"):
        Goal.like(picture, np.zeros((SIZE, SIZE), dtype=bool))
    with pytest.raises(LatentError, match="not finite"):
        Goal.like(picture * np.nan)
    with pytest.raises(LatentError, match="differ"):
        Goal(picture, picture[:3])
    search = GoalSearch(Goal.like(picture), np.zeros((2, 2)), np.ones((3, 2)))
    with pytest.raises(LatentError, match="do not answer"):
        search.answer(picture[None])


def test_candidates_look_like_the_goal(codes: np.ndarray) -> None:
    tfs = ToyCodec().decode(codes)
    volume = blobs()
    lengths = RayLengths.of(volume, draw_sample(Scene.of(volume, 16), 0, "holdout", 0).view)
    images = lengths.opacity_images(tfs)
    wanted = 11
    size = round(images.shape[1] ** 0.5)
    picture = np.repeat(images[wanted].reshape(size, size)[..., None], 4, axis=2)
    found = candidates_for(Goal.like(np.kron(picture, np.ones((2, 2, 1)))), None, codes, images)
    assert found[0] == pytest.approx(codes[wanted])
    present = np.array([0.5, 0.5])
    with_present = candidates_for(Goal.like(picture), present, codes, images)
    assert with_present[0] == pytest.approx(present)
    assert len(with_present) == len(found) + 1


@pytest.mark.slow
def test_random_tfs_are_found_by_their_pictures() -> None:
    """The shipped codec on a volume it has never seen; 20 random views and TFs."""
    volume = blobs()
    scene = Scene.of(volume, 16)
    space = LatentSpace.shipped(volume.scalar_range, scene.scalar_window)
    map_ = space.open_map()
    opacities = space.frame.stretched(map_.samples.tfs)
    renderer = RaycastRenderer(volume)
    errors = []
    for index in range(20):
        wanted = draw_sample(scene, 0, "holdout", index)

        def render(codes: np.ndarray, wanted: SceneInputs = wanted) -> np.ndarray:
            tfs = (space.tf_of(code) for code in codes)
            return np.stack(
                [renderer.render(SceneInputs(wanted.view, tf, wanted.color_tf), 24) for tf in tfs]
            )

        goal = Goal.like(renderer.render(wanted, 24))
        images = RayLengths.of(volume, wanted.view).opacity_images(opacities)
        search = GoalSearch(goal, candidates_for(goal, None, map_.codes, images), map_.codes)
        run(search, render)
        assert search.found is not None
        errors.append(search.found.error)
    renderer.close()
    assert np.median(errors) <= 0.05
