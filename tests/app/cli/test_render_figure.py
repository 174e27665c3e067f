from dataclasses import replace

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image
from PySide6.QtGui import QImage

from app.cli import run
from app.state.session import FIGURE_TEXT, Session, SessionContent
from app.state.settings import SessionSettings, VolumeMemory
from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.crop import CropBox
from model.scene.inputs import SceneInputs
from model.scene.mask import Mask
from model.scene.scene import LightDirection
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.volume_files import read_volume
from model.volume_files.masks import write_mask

RANGE = (0.0, 255.0)


@pytest.fixture(scope="module")
def base(tmp_path_factory):
    """A small ball beside the middle, so that it moves as it is turned."""
    folder = tmp_path_factory.mktemp("figures")
    z, y, x = np.mgrid[0:16, 0:18, 0:20]
    distance = np.sqrt((x - 15) ** 2 + (y - 8) ** 2 + (z - 8) ** 2)
    volume = folder / "ball_20x18x16_uint8.raw"
    volume.write_bytes(np.clip(255 - 60 * distance, 0, 255).astype(np.uint8).tobytes())
    color = ColorTF(RANGE, ((0.0, 0.1, 0.2, 0.9), (255.0, 1.0, 0.3, 0.2)))
    TransferFunction(OpacityTF(RANGE, (GaussianMode(200.0, 60.0, 0.9),)), color).save(
        folder / "tf.json"
    )
    return f"render --renderer raycast --volume {volume} --tf {folder / 'tf.json'} --view 0,10,0,1"


def picture(base, out, options):
    assert run(f"{base} {options} --out {out}".split()) == 0
    return np.asarray(Image.open(out)).astype(int)


def test_size_and_background(base, tmp_path):
    out = tmp_path / "image.png"
    wide = picture(base, out, "--size 300x150 --background white")
    assert wide.shape == (150, 300, 3)
    assert (wide[:20] == 255).all() and (wide[75, 100:200] != 255).any()
    assert picture(base, out, "--size 64 --background #102030")[0, 0].tolist() == [16, 32, 48]
    clear = picture(base, out, "--size 64 --background transparent")
    assert clear.shape == (64, 64, 4) and clear[0, 0, 3] == 0 and clear[..., 3].max() > 100


def test_pictures_say_what_drew_them_and_path_traced_ones_samples_and_error(base, tmp_path):
    out = tmp_path / "image.png"
    errors = []
    for samples in (4, 64):
        image = picture(base, out, f"--size 48 --lighting path --samples {samples} --no-denoise")
        assert image.max() > 50
        with Image.open(out) as saved:
            assert saved.info["Lighting"] == "path"
            said = saved.info["Renderer"]
        assert said.startswith(f"the path tracer, {samples} samples a pixel in ")
        errors.append(float(said.rsplit(" ", 1)[1]))
    assert 0 < errors[1] < errors[0] / 2
    # Or as many samples as an error takes.
    picture(base, out, "--size 48 --lighting path --error 0.02")
    with Image.open(out) as saved:
        said = saved.info["Renderer"]
    assert float(said.rsplit(" ", 1)[1]) <= 0.02
    assert 1 < int(said.split(", ")[1].split()[0]) < 1000
    # VTK has no soft light.
    picture(base.replace("raycast", "vtk"), out, "--size 48 --lighting soft")
    with Image.open(out) as saved:
        assert saved.info["Renderer"] == "the ray caster"


def test_legend_and_scale_bar(base, tmp_path):
    out = tmp_path / "image.png"
    plain = picture(base, out, "--size 400x200")
    figure = picture(base, out, "--size 400x200 --legend --scale-bar")
    changed = np.abs(figure - plain).max(axis=-1) > 60
    assert changed[170:, :120].any() and changed[60:, 320:].any()
    assert not changed[:60, :200].any()
    with Image.open(out) as saved:
        assert "middle of what is shown" in saved.info["Scale bar"]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_turntable(base, tmp_path):
    out = tmp_path / "turn.mp4"
    options = "--size 96x64 --seconds 0.8 --rate 10"
    assert run(f"{base} {options} --out {out}".split()) == 0
    movie = np.stack([frame[..., :3] for frame in iio.imiter(out)]).astype(float)
    assert movie.shape == (8, 64, 96, 3)
    assert [*tmp_path.iterdir()] == [out]
    columns = np.arange(96)
    brightness = movie.sum(axis=(1, 3))
    places = (brightness * columns).sum(axis=1) / brightness.sum(axis=1)
    # The ball is the middle of what is shown: it stays where it is.
    assert np.ptp(places) < 3
    first = picture(base, tmp_path / "first.png", "--size 96x64")
    assert np.abs(movie[0] - first).mean() < 6
    # What is left of it goes round, but the scale bar keeps its length.
    options = "--size 300 --seconds 0.8 --rate 10 --scale-bar --crop 0,.5,0,1,0,1"
    assert run(f"{base} {options} --out {out.with_suffix('.gif')}".split()) == 0
    frames = np.stack([*iio.imiter(out.with_suffix(".gif"))])
    bars = frames[:, 255:, :90, 1] > 200
    assert bars.any() and (bars == bars[0]).all()


VIEW, LIGHT = View(40.0, -10.0, 5.0, 0.8, 0.1, 0.0), LightDirection(50.0, 20.0)
CROP = CropBox((0.0, 0.0, 0.2), (1.0, 1.0, 1.0))


def mask_for(volume):
    return Mask.of(np.indices(volume.voxels.shape)[0] < volume.voxels.shape[0] // 2 + 1)


@pytest.fixture
def session(raw_file, tf_file, tmp_path):
    """A session of a small volume, looked at from elsewhere, lit, cropped and masked."""
    path = tmp_path / "seen.tfscope"
    tf = TransferFunction.load(tf_file)
    volume = read_volume(raw_file)
    write_mask(path.with_name("seen.mask.nrrd"), mask_for(volume), volume)
    lit = {"lighting": "direct", "light": LIGHT}
    memory = VolumeMemory(tf=tf, view=VIEW, **lit, crop=CROP, mask="seen.mask.nrrd")
    content = SessionContent(memory, SessionSettings(legend=True))
    Session(raw_file, volume.fingerprint, content).save(path)
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
    mask = mask_for(volume)
    expected = renderer.render(SceneInputs.of(VIEW, tf, light=LIGHT, crop=CROP, mask=mask), 48)
    image = drawn(session, tmp_path / "image.npy")
    assert image[..., 3].max() > 0.1
    np.testing.assert_allclose(image, expected, atol=1e-6)


def test_options_come_before_the_session(session, tmp_path, capsys):
    kept = drawn(session, tmp_path / "kept.npy")
    same = drawn(session, tmp_path / "same.npy", "--view", "40,-10,5,0.8,0.1,0")
    home = drawn(session, tmp_path / "home.npy", "--view", "30,20,0,1")
    unlit = drawn(session, tmp_path / "unlit.npy", "--lighting", "none")
    np.testing.assert_array_equal(kept, same)
    shown = np.ones(read_volume(Session.load(session).volume).voxels.shape, bool)
    shown[:, :, : shown.shape[2] // 2] = False
    write_mask(tmp_path / "half.nrrd", Mask.of(shown), read_volume(Session.load(session).volume))
    mask = "--mask", str(tmp_path / "half.nrrd"), "--labels"
    half = drawn(session, tmp_path / "half.npy", *mask, "shown")
    assert np.abs(kept - half).max() > 0.05
    out = "--out", str(tmp_path / "other.npy")
    assert run(["render", "--session", str(session), *out, *mask, "other"]) != 0
    assert "no label 'other'; it has 1 shown" in capsys.readouterr().err
    assert np.abs(kept - home).max() > 0.05
    assert np.abs(kept - unlit).max() > 0.05


def test_other_voxels_a_range_and_a_lost_volume_are_told(session, tmp_path, capsys):
    arguments = ["render", "--session", str(session), "--size", "32", "--renderer", "raycast"]
    out = ["--out", str(tmp_path / "image.png")]
    figure, holder = session.with_suffix(".png"), QImage(8, 8, QImage.Format.Format_RGB32)
    shown = Session.load(session)
    holder.setText(FIGURE_TEXT, shown.text())
    assert holder.save(str(figure))
    given = "--session", str(figure), "--volume", str(shown.volume)
    assert run(["render", *given, *arguments[3:], *out]) == 0
    assert "its mask is not in the figure" in capsys.readouterr().err
    replace(Session.load(session), fingerprint="of another").save(session)
    assert run([*arguments, *out]) == 0
    assert "voxels differ" in capsys.readouterr().err
    assert run([*arguments, *out, "--range", "0,100"]) != 0
    assert "its own range" in capsys.readouterr().err
    replace(Session.load(session), volume=tmp_path / "gone.nrrd").save(session)
    assert run([*arguments, *out]) != 0
    assert "no longer exists" in capsys.readouterr().err
