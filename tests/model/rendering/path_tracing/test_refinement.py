"""Refined pictures: cleaned while that helps, until they are good enough."""

import numpy as np
import pytest

from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.refinement import RefiningRenderer, drawn, refined

SHAPE = (2, 2, 3)


class Tracer:
    """Pictures of 1, 2, 4 ... samples of a grey scene, with the error of each."""

    sample_distance = 0.5
    volume = None

    def refine(self, inputs, size, samples, wanted=None, sample_distance=None):
        done = 1
        while done <= samples:
            rgba = np.full((2, 2, 4), 0.5, dtype=np.float32)
            halves = np.full((2, *SHAPE), 0.5, dtype=np.float32)
            error = np.inf if done == 1 else 0.4 / done
            yield Estimate(rgba, done, error, rgba[..., :3], rgba[..., :3], halves)
            done *= 2


class Cleaner:
    """Leaves an error of .03, however many samples there are."""

    doubling = 1.0

    def __init__(self):
        self.cleaned = []

    def clean(self, radiance, estimate, samples):
        self.cleaned.append(samples)
        return np.full(SHAPE, 0.53, dtype=np.float32)

    def deed(self, samples):
        return "cleaned" if samples < 8 else "cleaned well"


@pytest.fixture
def cleaner():
    return Cleaner()


def test_a_picture_is_cleaned_until_its_noise_is_less_than_what_that_leaves(cleaner):
    found = list(refined(Tracer(), None, 2, 32, cleaning=lambda *scene: cleaner))
    assert [each.samples for each in found] == [1, 2, 4, 8, 16, 32]
    assert [each.deed for each in found[2:]] == ["cleaned", "cleaned well", "", ""]
    expected = [np.inf, np.inf, 0.03, 0.03, 0.025, 0.0125]
    np.testing.assert_allclose([each.error for each in found], expected, rtol=1e-5)
    assert all((each.rgba.max() > 0.5) == bool(each.deed) for each in found)
    # The fourth again, as what cleans the eighth does it in another way.
    assert cleaner.cleaned == [1, 2, 4, 4, 8]


def test_no_more_samples_are_drawn_than_an_error_takes(cleaner):
    clean = refined(Tracer(), None, 2, 1024, cleaning=lambda *scene: cleaner, error=0.031)
    assert list(clean)[-1].samples == 4
    assert list(refined(Tracer(), None, 2, 1024, cleaning=None, error=0.03))[-1].samples == 16


def test_a_whole_picture_is_the_last_of_those(cleaner):
    whole = drawn(Tracer(), None, 2, 4, cleaning=lambda *scene: cleaner)
    assert (whole.samples, whole.deed) == (4, "cleaned")
    assert whole.error == pytest.approx(0.03, rel=1e-5)
    assert cleaner.cleaned == [2, 4]
    aimed = drawn(Tracer(), None, 2, 1024, cleaning=lambda *scene: cleaner, error=0.031)
    assert aimed.samples == 4


def test_without_what_cleans_them_pictures_stay_as_they_were_traced():
    assert not any(each.deed for each in refined(Tracer(), None, 2, 8, cleaning=None))
    assert RefiningRenderer(Tracer(), None, 8).render(None, 2).max() == 0.5
