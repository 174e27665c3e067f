import numpy as np
import pytest
from blobs import blobs
from lively import SIZE, lively_network

from model.generator.generator import Generator
from model.latent.latent_space import LatentSpace
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.paper.subject import Subject
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_sample
from model.scene.scene import Scene


@pytest.fixture(scope="package")
def folder(tmp_path_factory):
    """An untrained model of the paper's networks."""
    folder = tmp_path_factory.mktemp("paper") / "model"
    scene = Scene.of(blobs(), 64, tf_family="paper")
    save_model(folder, ModelCard(scene, "draft", SIZE), lively_network())
    return folder


@pytest.fixture(scope="package")
def subject(folder):
    generator, volume = Generator.load(folder, "cpu"), blobs()
    renderer = RaycastRenderer(volume, "none", None, generator.scene.sample_distance)
    subject = Subject(folder, generator, volume, LatentSpace.of_model(folder), renderer)
    yield subject
    subject.close()


@pytest.fixture(scope="package")
def inputs(subject):
    """A sample whose TF leaves values free."""
    scene = subject.generator.scene
    samples = (draw_sample(scene, 0, "train", index) for index in range(50))
    return next(s for s in samples if np.median(s.opacity_tf.sample(scene.scalar_range)) < 0.2)
