"""``render --session`` draws what the window showed."""

from dataclasses import replace

import numpy as np
import pytest

from app.cli import run
from app.state.session import Session, SessionContent
from app.state.settings import SessionSettings, VolumeMemory
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.scene import LightDirection
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.volume_files import read_volume

VIEW, LIGHT = View(40.0, -10.0, 5.0, 0.8, 0.1, 0.0), LightDirection(50.0, 20.0)
CROP = CropBox((0.0, 0.0, 0.2), (1.0, 1.0, 1.0))


@pytest.fixture
def session(raw_file, tf_file, tmp_path):
    """A session of a small volume, looked at from elsewhere, lit, and cropped."""
    path = tmp_path / "seen.tfscope"
    tf = TransferFunction.load(tf_file)
    memory = VolumeMemory(tf=tf, view=VIEW, lighting="direct", light=LIGHT, crop=CROP)
    content = SessionContent(memory, SessionSettings(legend=True))
    Session(raw_file, read_volume(raw_file).fingerprint, content).save(path)
    return path


def drawn(session, out, *others):
    arguments = f"render --renderer raycast --session {session} --size 48 --out {out}"
    assert run([*arguments.split(), *others]) == 0
    return np.load(out)


def test_all_of_a_session_is_drawn(session, tmp_path):
    shown = Session.load(session)
    volume = read_volume(shown.volume)
    tf = shown.content.memory.tf
    renderer = RaycastRenderer(volume.over(tf.scalar_range, tf.scale), "direct", LIGHT)
    expected = renderer.render(SceneInputs.of(VIEW, tf, light=LIGHT, crop=CROP), 48)
    renderer.close()
    image = drawn(session, tmp_path / "image.npy")
    assert image[..., 3].max() > 0.1
    np.testing.assert_allclose(image, expected, atol=1e-6)


def test_options_come_before_the_session(session, tmp_path):
    kept = drawn(session, tmp_path / "kept.npy")
    same = drawn(session, tmp_path / "same.npy", "--view", "40,-10,5,0.8,0.1,0")
    home = drawn(session, tmp_path / "home.npy", "--view", "30,20,0,1")
    unlit = drawn(session, tmp_path / "unlit.npy", "--lighting", "none")
    np.testing.assert_array_equal(kept, same)
    assert np.abs(kept - home).max() > 0.05
    assert np.abs(kept - unlit).max() > 0.05


def test_other_voxels_a_range_and_a_lost_volume_are_told(session, tmp_path, capsys):
    arguments = ["render", "--session", str(session), "--size", "32", "--renderer", "raycast"]
    out = ["--out", str(tmp_path / "image.png")]
    replace(Session.load(session), fingerprint="of another").save(session)
    assert run([*arguments, *out]) == 0
    assert "other voxels" in capsys.readouterr().err
    assert run([*arguments, *out, "--range", "0,100"]) != 0
    assert "its own range" in capsys.readouterr().err
    replace(Session.load(session), volume=tmp_path / "gone.nrrd").save(session)
    assert run([*arguments, *out]) != 0
    assert "not there any more" in capsys.readouterr().err
