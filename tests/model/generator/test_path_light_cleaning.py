import numpy as np
import pytest
import torch
from ramp import make_tf, make_volume

from model.generator.path_light_cleaning import MOST_PIXELS, MOST_SAMPLES, cleaning_of
from model.networks.path_light_network import (
    PathLightCard,
    PathLightNetwork,
    PathLightSize,
    save_path_light,
)
from model.rendering.path_tracing import denoising
from model.rendering.path_tracing.denoising import denoiser
from model.rendering.path_tracing.refinement import RefiningRenderer
from model.rendering.path_tracing.renderer import PathTracer
from model.rendering.raster import Raster
from model.scene.default_tf import default_transfer_function
from model.scene.inputs import SceneInputs
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.shipped import shipped_volumes

needs_denoiser = pytest.mark.skipif(not denoising.available(), reason="no denoiser here")
SMALL = PathLightSize(8)


@needs_denoiser
@pytest.mark.parametrize("most_pixels", [0, MOST_PIXELS])
def test_pictures_of_few_samples_are_finished_and_those_of_many_denoised(
    tmp_path, monkeypatch, most_pixels
):
    monkeypatch.setattr("model.generator.path_light_cleaning.MOST_PIXELS", most_pixels)
    torch.manual_seed(1)
    network, file = PathLightNetwork(SMALL), tmp_path / "network.safetensors"
    torch.nn.init.normal_(network.out.weight, std=0.05)
    save_path_light(file, PathLightCard(SMALL), network)
    volume, raster = make_volume(), Raster(41, 31)
    inputs = SceneInputs.of(View(), make_tf(120.0))
    tracer = PathTracer(volume, threads=1)
    cleaning, close = cleaning_of(volume, network=file)
    assert cleaning is not None
    alone, finishing = (each(inputs, raster) for each in (denoiser, cleaning))
    for traced in tracer.refine(inputs, raster, 2 * MOST_SAMPLES):
        given = traced.radiance, traced, traced.samples
        plain, found = (each.clean(*given) for each in (alone, finishing))
        assert found.shape == (31, 41, 3)
        assert np.array_equal(plain, found) == (traced.samples > MOST_SAMPLES)
    # Nothing shines where nothing is.
    for picture in RefiningRenderer(tracer, cleaning).refined(inputs, raster, MOST_SAMPLES):
        np.testing.assert_array_equal(picture.rgba[..., 3], traced.rgba[..., 3])
        assert (picture.rgba[picture.rgba[..., 3] == 0] == 0).all()
    close()


def test_where_a_part_is_missing_the_rest_cleans(tmp_path, monkeypatch):
    volume = make_volume()
    (tmp_path / "damaged.safetensors").write_bytes(b"no network")
    monkeypatch.setattr(denoising, "available", lambda: True)
    for name in ("missing", "damaged"):
        assert cleaning_of(volume, network=tmp_path / f"{name}.safetensors")[0] is denoiser
    assert cleaning_of(volume, cleans=False)[0] is None
    monkeypatch.setattr(denoising, "available", lambda: False)
    assert cleaning_of(volume)[0] is None


@needs_denoiser
@pytest.mark.slow
@pytest.mark.parametrize("size", [128, 272])
def test_the_shipped_network_is_nearer_to_the_truth_than_the_denoiser(size):
    for path in shipped_volumes():
        volume = read_volume(path)
        inputs = SceneInputs.of(View(140, 25, 0, 0.7), default_transfer_function(volume))
        *_, exact = PathTracer(volume, seed=5).refine(inputs, size, 64)
        cleaning, close = cleaning_of(volume)
        each = [RefiningRenderer(PathTracer(volume), way) for way in (denoiser, cleaning)]
        for alone, shown in zip(*(one.refined(inputs, size, 2) for one in each), strict=True):
            errors = [np.square(one.rgba - exact.rgba).mean() for one in (alone, shown)]
            assert errors[1] < errors[0]
        close()
