"""Refined pictures: cleaned while that helps, until they are good enough."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from model.rendering.path_tracing import refinement
from model.rendering.path_tracing.refinement import RefiningRenderer, drawn, refined


class Tracer:
    """Pictures of 1, 2, 4 ... samples, with the error of each."""

    sample_distance = 0.5
    volume = None

    def refine(self, inputs, size, samples, wanted=None, sample_distance=None):
        done = 1
        while done <= samples:
            error = np.inf if done == 1 else 0.4 / done
            yield SimpleNamespace(rgba=np.zeros((2, 2, 4)), samples=done, error=error)
            done *= 2


class Cleaner:
    """Leaves an error of .03, however many samples there are."""

    def __init__(self) -> None:
        self.cleaned: list[int] = []

    def deed(self, samples: int) -> str:
        return f"cleaned of {samples}"


@pytest.fixture
def cleaner(monkeypatch: pytest.MonkeyPatch) -> Cleaner:
    def cleaned(estimate, cleaner):
        cleaner.cleaned.append(estimate.samples)
        return np.ones((2, 2, 4))

    def error_of(estimate, cleaner) -> float:
        return np.inf if estimate.samples == 1 else 0.03

    monkeypatch.setattr(refinement, "cleaned", cleaned)
    monkeypatch.setattr(refinement, "error_of", error_of)
    return Cleaner()


def test_a_picture_is_cleaned_until_its_noise_is_less_than_what_that_leaves(
    cleaner: Cleaner,
) -> None:
    found = list(refined(Tracer(), None, 2, 32, cleaning=lambda *scene: cleaner))
    assert [each.samples for each in found] == [1, 2, 4, 8, 16, 32]
    assert [each.deed for each in found[3:]] == ["cleaned of 8", "", ""]
    assert [each.error for each in found[1:]] == [0.03, 0.03, 0.03, 0.025, 0.0125]
    assert all(each.rgba.max() == bool(each.deed) for each in found)


def test_no_more_samples_are_drawn_than_an_error_takes(cleaner: Cleaner) -> None:
    clean = refined(Tracer(), None, 2, 1024, cleaning=lambda *scene: cleaner, error=0.03)
    assert list(clean)[-1].samples == 2
    assert list(refined(Tracer(), None, 2, 1024, cleaning=None, error=0.03))[-1].samples == 16


def test_a_whole_picture_is_the_last_of_those_and_cleaned_once(cleaner: Cleaner) -> None:
    whole = drawn(Tracer(), None, 2, 8, cleaning=lambda *scene: cleaner)
    assert (whole.samples, whole.error, whole.deed) == (8, 0.03, "cleaned of 8")
    assert cleaner.cleaned == [8]
    aimed = drawn(Tracer(), None, 2, 1024, cleaning=lambda *scene: cleaner, error=0.03)
    assert aimed.samples == 2


def test_without_what_cleans_them_pictures_stay_as_they_were_traced() -> None:
    assert not any(each.deed for each in refined(Tracer(), None, 2, 8, cleaning=None))
    assert RefiningRenderer(Tracer(), None, 8).render(None, 2).max() == 0
