from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import torch
from blobs import blobs
from lively import SIZE, lively_network

from model.generator.generator import Generator
from model.latent.codes import sample_codes
from model.latent.embedding import principal_places
from model.latent.latent_map import LatentMap
from model.latent.latent_space import LatentSpace
from model.measurements import processors
from model.networks.card import ModelCard
from model.networks.checkpoint import save_model
from model.networks.generator_network import decode_unit
from model.paper import edits
from model.paper.exploration import DETAIL_SHARE, WHOLE_SHARE, detail, overview
from model.paper.subject import Subject
from model.paper.tables import PAPER_TABLE_1, holdout_errors, table_1
from model.rendering.raycast.renderer import RaycastRenderer
from model.samples.sampling import draw_opacity_tfs, draw_sample
from model.scene.scene import Scene
from model.scene.tf_perturbation import edit_around, with_opacity
from model.scene.transfer_function import GaussianMode, OpacityTF
from model.sensitivity.display import per_small_edit
from model.sensitivity.what_if import compare


@pytest.fixture(scope="module")
def subject(tmp_path_factory):
    """An untrained model of the paper's networks."""
    folder, volume = tmp_path_factory.mktemp("paper") / "model", blobs()
    scene = Scene.of(volume, 64, tf_family="paper")
    save_model(folder, ModelCard(scene, "draft", SIZE), lively_network())
    generator = Generator.load(folder, "cpu")
    renderer = RaycastRenderer(volume, "none", None, generator.scene.sample_distance)
    subject = Subject(folder, generator, volume, LatentSpace.of_model(folder), renderer)
    yield subject
    subject.close()


@pytest.fixture(scope="module")
def inputs(subject):
    """A sample whose TF leaves values free."""
    scene = subject.generator.scene
    samples = (draw_sample(scene, 0, "train", index) for index in range(50))
    return next(s for s in samples if np.median(s.opacity_tf.sample(scene.scalar_range)) < 0.2)


def test_a_mode_is_suggested_where_most_is_promised_and_room_is_left(subject, inputs):
    scene = subject.generator.scene
    lo, hi = scene.scalar_range
    values = np.linspace(lo, hi, 256)
    bare = replace(inputs, opacity_tf=OpacityTF(scene.scalar_range))
    responses = np.zeros(256)
    # A strong place outside the window, one that is opaque already, and a weaker negative one.
    responses[[0, 120, 160]] = 9.0, 5.0, -2.0
    opaque = GaussianMode(float(values[120]), 0.02 * (hi - lo), 1.0)
    taken = replace(inputs, opacity_tf=OpacityTF(scene.scalar_range, (opaque,)))
    assert edits.suggested_mode(scene, bare, responses).mean == pytest.approx(values[120])
    found = edits.suggested_mode(scene, taken, responses)
    assert found.mean == pytest.approx(values[160])
    assert taken.opacity_tf(found.mean) < edits.MOST_OPACITY
    taken = GaussianMode(values[120], found.width, 0.1)
    again = edits.suggested_mode(scene, bare, responses, taken)
    assert again.mean == pytest.approx(values[160])
    assert found.amplitude == edits.AMPLITUDE


@pytest.mark.parametrize("as_curve", [False, True])
def test_a_mode_is_added_to_modes_and_to_curves(subject, inputs, as_curve):
    scene = subject.generator.scene
    lo, hi = scene.scalar_range
    tf = OpacityTF(scene.scalar_range, (GaussianMode(lo + 0.3 * (hi - lo), 0.1 * (hi - lo), 0.4),))
    values = np.linspace(lo, hi, 256)
    before = tf.sample()
    if as_curve:
        points = tuple(zip(values.tolist(), before.tolist(), strict=True))
        tf = OpacityTF(scene.scalar_range, points=points)
    mode = GaussianMode(lo + 0.6 * (hi - lo), 0.05 * (hi - lo), 0.3)
    after = edits.with_mode(replace(inputs, opacity_tf=tf), mode).opacity_tf.sample()
    bump = 0.3 * np.exp(-(((values - mode.mean) / mode.width) ** 2))
    np.testing.assert_allclose(after, before + bump, atol=1e-4)


def test_each_row_goes_on_from_the_edit_before(subject, inputs):
    steps = edits.region_edits(subject, inputs)
    assert [step.region is None for step in steps] == [False, False, True]
    for before, after in pairwise(steps):
        assert before.mode is not None and before.region is not None
        assert after.inputs == edits.with_mode(before.inputs, before.mode)
        mask = before.region.mask(subject.size)
        np.testing.assert_allclose(after.drawn, subject.drawn(after.inputs), atol=1e-6)
        assert before.changes[0] == pytest.approx(compare(before.drawn, after.drawn, mask).rmse)
        assert before.changes[1] == pytest.approx(compare(before.truth, after.truth, mask).rmse)


def test_responses_of_a_region_are_those_of_small_edits(subject, inputs):
    """Against the network itself, by images of slightly more opacity at one value."""
    scene = subject.generator.scene
    opacity = np.clip(inputs.opacity_tf.sample(scene.scalar_range), 0.1, 0.9)
    # So that there is room for less opacity, too.
    inputs = with_opacity(inputs, opacity)
    (step, *_) = edits.region_edits(subject, inputs)
    assert step.region is not None and step.responses is not None
    mask = step.region.mask(subject.size)
    index = 128
    values = np.linspace(*scene.scalar_range, 256)
    edit = edit_around(values[index], scene.scalar_range, 6.0)
    height = 1e-3 * per_small_edit(edit) / 0.01
    norms = []
    for sign in (-1, 1):
        image = subject.drawn(with_opacity(inputs, opacity + sign * height * edit))
        norms.append(np.linalg.norm(image[mask].astype(np.float64)))
    slope = (norms[1] - norms[0]) / (2 * 1e-3) * 0.01 / np.sqrt(3 * mask.sum())
    assert step.responses[index] == pytest.approx(slope, rel=0.1, abs=1e-5)


def test_two_scales_of_one_map(subject, inputs):
    known = draw_opacity_tfs(subject.generator.scene, 0, 0, 300)
    samples = sample_codes(subject.space.codec, known, 200)
    map_ = LatentMap(samples, principal_places(samples.codes), is_final=True)
    whole = overview(subject, map_, inputs)
    finer = detail(subject, map_, whole)
    extent = np.ptp(map_.places, axis=0)
    for one, share in ((whole, WHOLE_SHARE), (finer, DETAIL_SHARE)):
        left, lower, right, upper = one.brush
        assert (right - left, upper - lower) == pytest.approx(tuple(share * extent), rel=1e-3)
        assert left <= one.hovered.place[0] <= right and lower <= one.hovered.place[1] <= upper
        expected = subject.generator.render_latent(one.hovered.code[None], one.inputs)[0, ..., :3]
        np.testing.assert_allclose(one.hovered.image, expected, atol=1e-5)
        codes = torch.from_numpy(one.hovered.code)[None]
        expected = decode_unit(subject.generator.network.codec.decode(codes))[0].detach()
        np.testing.assert_allclose(one.hovered.opacities, expected.numpy(), atol=1e-5)
        means = map_.cells(one.brush)
        for row, column in np.argwhere(means.count > 0):
            picture = subject.generator.render_latent(means.codes[row, [column]], one.inputs)
            np.testing.assert_allclose(one.cells[row, column], picture[0, ..., :3], atol=1e-5)
        assert np.isnan(one.cells[means.count == 0]).all()
    # From the other side, and nearer.
    assert finer.inputs.view.azimuth - inputs.view.azimuth == 180
    assert finer.inputs.view.distance <= inputs.view.distance


def test_table_1_has_our_rows_before_the_papers(subject, monkeypatch):
    # 200,000 images at .36 s each.
    monkeypatch.setattr("model.paper.tables._sample_seconds", lambda *_: 0.36 * processors())
    errors = holdout_errors(subject, 4)
    table = table_1([subject], [errors], 4, 2)
    assert len(table.rows) == 1 + len(PAPER_TABLE_1)
    assert {len(row) for row in table.rows} == {len(table.heading)}
    ours = dict(zip(table.heading, table.rows[0], strict=True))
    assert ours["image RMSE"] == f"{errors['rmse']:.3f}"[1:]
    assert ours["200,000 training images"] == "20.0 h"
    assert ours["resolution"] == " x ".join(map(str, subject.volume.dimensions))
    # The paper's jet, as it is printed there.
    assert table.rows[7][:1] + table.rows[7][5:8] == ("paper: Jet", "4 h", ".086", ".022")
