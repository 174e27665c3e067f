"""Pictures that become finer, and moving ones whose light is found again as the view turns."""

from dataclasses import replace

import numpy as np
import pytest

from model.rendering.path_tracing.denoising import available, denoiser
from model.rendering.path_tracing.estimate import Estimate
from model.rendering.path_tracing.moving_light import MOST, LightHistory, coarse, light_of, relit
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster, resized
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.inputs import SceneInputs
from model.scene.transfer_function import ColorTF, OpacityTF
from model.scene.view import View
from model.scene.volume import Volume

SHAPE = (2, 2, 3)


class Tracer:
    """Pictures of 1, 2, 4 ... samples of a grey scene, with the error of each."""

    sample_distance = 0.5
    volume = None

    def refine_in_turns(self, inputs, size, samples, wanted, sample_distance):
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

    def method(self, samples):
        return "cleaned" if samples < 8 else "cleaned well"


@pytest.fixture
def cleaner():
    return Cleaner()


def test_a_picture_is_cleaned_until_its_noise_is_less_than_what_that_leaves(cleaner):
    found = list(RefiningRenderer(Tracer(), lambda *scene: cleaner).refined(None, 2, 32))
    assert [each.samples for each in found] == [1, 2, 4, 8, 16, 32]
    assert [each.method for each in found[2:]] == ["cleaned", "cleaned well", "", ""]
    expected = [np.inf, np.inf, 0.03, 0.03, 0.025, 0.0125]
    np.testing.assert_allclose([each.error for each in found], expected, rtol=1e-5)
    assert all((each.rgba.max() > 0.5) == bool(each.method) for each in found)
    # The fourth again, as what cleans the eighth does it in another way.
    assert cleaner.cleaned == [1, 2, 4, 4, 8]


def test_no_more_samples_are_drawn_than_an_error_takes(cleaner):
    clean = RefiningRenderer(Tracer(), lambda *scene: cleaner).refined(None, 2, 1024, error=0.031)
    assert list(clean)[-1].samples == 4
    assert (
        list(RefiningRenderer(Tracer(), None).refined(None, 2, 1024, error=0.03))[-1].samples == 16
    )


def test_a_whole_picture_is_the_last_of_those(cleaner):
    whole = RefiningRenderer(Tracer(), lambda *scene: cleaner).drawn(None, 2, 4)
    assert (whole.samples, whole.method) == (4, "cleaned")
    assert whole.error == pytest.approx(0.03, rel=1e-5)
    assert cleaner.cleaned == [2, 4]


def test_without_what_cleans_them_pictures_stay_as_they_were_traced():
    assert not any(each.method for each in RefiningRenderer(Tracer(), None).refined(None, 2, 8))
    assert RefiningRenderer(Tracer(), None, 8).render(None, 2).max() == 0.5


RNG = np.random.default_rng(1)


def whole(volume, view):
    """Return inputs under which higher values are more opaque, and of other colours."""
    low, high = volume.scalar_range
    middle = (low + high) / 2
    opacity = OpacityTF((low, high), points=((low, 0.0), (middle, 0.1), (high, 0.9)))
    # Stripes, which only pixels of their own can show.
    values = np.linspace(low, high, 11).tolist()
    stops = tuple((at, 0.9, 0.2 + 0.7 * (n % 2), 0.1) for n, at in enumerate(values))
    return SceneInputs(view, opacity, ColorTF((low, high), stops))


def test_details_of_the_colours_stay_under_even_light():
    unlit = RNG.random((20, 24, 4), dtype=np.float32)
    unlit[..., :3] *= unlit[..., 3:]
    few = resized(unlit, (unlit.shape[0] // 2, unlit.shape[1] // 2))[..., :3]
    for factor in (0.5, 1.0):
        picture = relit(unlit, np.full_like(few, factor), few)
        # The offset that keeps faint colours from dividing by zero is there, too.
        expected = np.clip(factor * (unlit[..., :3] + 0.02) - 0.02, 0, 1)
        np.testing.assert_allclose(picture[..., :3], expected, atol=1e-6)
        np.testing.assert_array_equal(picture[..., 3], unlit[..., 3])


def test_nothing_shines_where_nothing_is():
    unlit = np.zeros((8, 8, 4), dtype=np.float32)
    unlit[2:6, 2:6] = 0.5
    few = resized(unlit, (unlit.shape[0] // 2, unlit.shape[1] // 2))[..., :3]
    picture = relit(unlit, light_of(0.5 * few, few), few)
    assert not picture[unlit[..., 3] == 0].any()
    # The silhouette has the light of what is inside.
    np.testing.assert_allclose(picture[2:6, 2:6, 0], 0.25, atol=0.02)


@pytest.mark.skipif(not available(), reason="no denoiser for this machine")
def test_a_moving_picture_is_nearer_than_one_of_fewer_pixels():
    z, y, x = np.mgrid[-1:1:48j, -1:1:48j, -1:1:48j]
    waves = 20 * np.sin(25 * x) * np.sin(25 * y) * np.sin(25 * z)
    volume = Volume((120 + waves - 100 * (x**2 + y**2 + z**2)).astype(np.float32).clip(0))
    inputs = whole(volume, View(30.0, 20.0, 0.0, 0.8))
    raster = Raster(72, 64)
    renderer = RefiningRenderer(PathTracer(volume), denoiser)
    moving = renderer.moving(inputs, raster)
    few = renderer.drawn(inputs, coarse(raster), 1)
    assert moving is not None and few is not None and moving.samples == few.samples == 1
    truth = PathTracer(volume, seed=1).render(inputs, raster, samples=256)
    errors = [
        float(np.sqrt(np.mean((image - truth)[..., :3] ** 2)))
        for image in (moving.rgba, resized(few.rgba, raster.shape))
    ]
    assert errors[0] < 0.9 * errors[1]
    opacity = RaycastRenderer(volume).render(inputs, raster)[..., 3]
    np.testing.assert_allclose(moving.rgba[..., 3], opacity, atol=1e-6)


SIZE = 48


@pytest.fixture(scope="module")
def block():
    """An opaque block in which each place has another value, longer along one axis."""
    z, y, x = np.mgrid[-1:1:40j, -1:1:32j, -1:1:24j]
    values = 120 + 40 * np.sin(3 * x + y) + 40 * np.sin(3 * y - z)
    return Volume(values.astype(np.float32), (1.2, 0.9, 0.8))


def inputs_from(azimuth, volume):
    low, high = volume.scalar_range
    opacity = OpacityTF((low, high), points=((low, 1.0), (high, 1.0)))
    color = ColorTF((low, high), ((low, 0.0, 0.0, 0.0), (high, 1.0, 1.0, 1.0)))
    return SceneInputs(View(azimuth, 15.0, 5.0, 0.9, 0.1, -0.05), opacity, color)


def looks(volume, inputs):
    rgba, depth = RaycastRenderer(volume).frame(inputs, SIZE)
    return rgba[..., :3], depth


def test_places_are_found_where_they_were_seen_before(block):
    first, turned = inputs_from(30.0, block), inputs_from(36.0, block)
    before, depth = looks(block, first)
    now, depth_now = looks(block, turned)
    raster, history = Raster(SIZE, SIZE), LightHistory(block)
    # The colours themselves, which belong to places, take the part of light.
    history.averaged(first, raster, before, depth)
    mean = history.averaged(turned, raster, now, depth_now)
    found = 2 * mean - now
    # Away from the silhouette, where a pixel has places of several depths.
    inner = np.isfinite(depth_now)
    for axis in (0, 1):
        inner &= np.roll(inner, 2, axis) & np.roll(inner, -2, axis)
    known = inner & np.any(mean != now, axis=2)
    assert known.sum() > 0.7 * inner.sum()
    gap = np.abs(found - now)[known].mean()
    assert gap < 0.006
    # What would be taken from the same pixels is another place's.
    assert np.abs(before - now)[known].mean() > 10 * gap


def test_noise_becomes_less_and_an_edit_begins_anew(block):
    inputs, raster, history = inputs_from(30.0, block), Raster(SIZE, SIZE), LightHistory(block)
    depth = np.full((SIZE, SIZE), block.radius, dtype=np.float32)
    rng = np.random.default_rng(5)

    def noise():
        return 1 + rng.standard_normal((SIZE, SIZE, 3)).astype(np.float32)

    spreads = [history.averaged(inputs, raster, noise(), depth).std() for _ in range(40)]
    # The mean of two, and what an exponential one tends to.
    assert spreads[1] == pytest.approx(2**-0.5, rel=0.05)
    assert spreads[-1] == pytest.approx((1 / (2 * MOST - 1)) ** 0.5, rel=0.1)
    low, high = block.scalar_range
    edited = replace(inputs, opacity_tf=OpacityTF((low, high), points=((low, 0.0), (high, 0.5))))
    assert history.averaged(edited, raster, noise(), depth).std() == pytest.approx(1, rel=0.05)
