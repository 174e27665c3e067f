"""Refined pictures: denoised while that helps, until they are good enough."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.refinement import RefiningRenderer, drawn, refined


class Tracer:
    """Pictures of 1, 2, 4 ... samples, with the error of each."""

    sample_distance = 0.5

    def refine(self, inputs, size, samples, wanted=None, sample_distance=None):
        done = 1
        while done <= samples:
            error = np.inf if done == 1 else 0.4 / done
            yield SimpleNamespace(rgba=np.zeros((2, 2, 4)), samples=done, error=error)
            done *= 2


@pytest.fixture
def denoiser(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave an error of .03, however many samples there are."""
    monkeypatch.setattr(denoising, "available", lambda: True)
    monkeypatch.setattr(denoising, "denoised", lambda estimate: np.ones((2, 2, 4)))
    monkeypatch.setattr(denoising, "error_of", lambda each: np.inf if each.samples == 1 else 0.03)


@pytest.mark.usefixtures("denoiser")
def test_a_picture_is_denoised_until_its_noise_is_less_than_what_that_leaves() -> None:
    found = list(refined(Tracer(), None, 2, 32, denoises=True))
    assert [each.samples for each in found] == [1, 2, 4, 8, 16, 32]
    assert [each.is_denoised for each in found] == [True] * 4 + [False] * 2
    assert [each.error for each in found[1:]] == [0.03, 0.03, 0.03, 0.025, 0.0125]
    assert all(each.rgba.max() == each.is_denoised for each in found)


@pytest.mark.usefixtures("denoiser")
def test_no_more_samples_are_drawn_than_an_error_takes() -> None:
    assert list(refined(Tracer(), None, 2, 1024, denoises=True, error=0.03))[-1].samples == 2
    assert list(refined(Tracer(), None, 2, 1024, denoises=False, error=0.03))[-1].samples == 16


@pytest.mark.usefixtures("denoiser")
def test_a_whole_picture_is_the_last_of_those_and_denoised_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    denoised: list[int] = []

    def denoise(estimate):
        denoised.append(estimate.samples)
        return np.ones((2, 2, 4))

    monkeypatch.setattr(denoising, "denoised", denoise)
    whole = drawn(Tracer(), None, 2, 8, denoises=True)
    assert (whole.samples, whole.error, whole.is_denoised) == (8, 0.03, True)
    assert denoised == [8]
    assert drawn(Tracer(), None, 2, 1024, denoises=True, error=0.03).samples == 2


def test_without_the_package_pictures_stay_as_they_were_traced(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(denoising, "available", lambda: False)
    assert not any(each.is_denoised for each in refined(Tracer(), None, 2, 8, denoises=True))
    assert RefiningRenderer(Tracer(), True, 8).render(None, 2).max() == 0
