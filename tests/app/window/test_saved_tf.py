from dataclasses import replace

import numpy as np
import pytest
from rested_window import notice_buttons

from model.rendering.raycast.renderer import RaycastRenderer
from model.scene.transfer_function import ColorTF, GaussianMode, OpacityTF, TransferFunction
from model.scene.view import View
from model.scene.volume import Volume

WIDE, NARROW = (0.0, 65535.0), (29_900.0, 30_200.0)


def shells():
    """Shells of values over all 16 bits, most of the voxels about 30,000, as in a specimen."""
    z, y, x = np.mgrid[0:14, 0:15, 0:16]
    distance = np.sqrt((x - 8) ** 2 + (y - 7) ** 2 + (z - 7) ** 2)
    values = np.rint(30_000 + 40 * np.sin(distance))
    values[distance < 2] = 65_535
    values[distance > 6] = 0
    return Volume(values.astype(np.float32), name="shells")


def colors(scalar_range):
    lo, hi = scalar_range
    return ColorTF(scalar_range, ((lo, 0.1, 0.3, 0.9), ((lo + hi) / 2, 1, 1, 0), (hi, 1, 0, 0)))


def curve(scalar_range, count):
    heights = np.random.default_rng(count).uniform(0, 0.8, count).tolist()
    values = np.linspace(*scalar_range, count).tolist()
    return OpacityTF(scalar_range, points=tuple(zip(values, heights, strict=True)))


BAND = ((29_977.0, 0.0), (30_000.0, 0.9), (30_023.0, 0.0))
KINDS = {
    "a narrow mode of a wide range": OpacityTF(WIDE, (GaussianMode(30_000.0, 10.0, 0.8),)),
    "a band of a wide range": OpacityTF(WIDE, points=((0.0, 0.0), *BAND, (65_535.0, 0.0))),
    "19 points": curve(NARROW, 19),
    "a step at each end": OpacityTF(
        NARROW, points=((29_900, 0), (29_900, 0.5), (30_200, 0.5), (30_200, 0))
    ),
    "beyond the voxels": OpacityTF((-4e4, 2e5), (GaussianMode(3e4, 9e3, 0.4),)),
}


def picture(window):
    opened = window.workspace.opened
    assert opened is not None and opened.volume.scalar_range == window.state.scalar_range
    renderer = RaycastRenderer(opened.volume, threads=1)
    # The view may still follow the size of a window that was just opened.
    image = renderer.render(replace(window.state.inputs, view=View(30.0, 15.0)), 32)
    renderer.close()
    return image


def open_over(qtbot, window, change):
    """Change the TF, and wait until the volume is shown over its range."""
    change()
    work, state = window.workspace, window.state
    qtbot.waitUntil(lambda: work.opened.volume.scalar_range == state.scalar_range)


@pytest.fixture(autouse=True)
def opened_shells(builders):
    builders.volumes["shells"] = shells()


def test_what_is_too_narrow_for_the_range_is_said_with_a_range_for_it(qtbot, make_window, tmp_path):
    window = make_window("shells", model=None)
    tf = TransferFunction(KINDS["a narrow mode of a wide range"], colors(WIDE))
    tf.save(tmp_path / "tf.json")
    open_over(qtbot, window, lambda: window.files.open_transfer_function(tmp_path / "tf.json"))
    assert "finer than 1/256 of the range 0 to 65,535" in window.notice.text
    (button,) = (b for text, b in notice_buttons(window).items() if text.startswith("Show "))
    before = picture(window)
    open_over(qtbot, window, button.click)
    assert "finer" not in window.notice.text
    lo, hi = window.state.scalar_range
    assert 29_900 <= lo < 29_980 < 30_020 < hi <= 30_200
    assert np.abs(picture(window) - before).max() > 0.1
    # As if the TF had been made over that range.
    exact = TransferFunction(OpacityTF((lo, hi), tf.opacity.modes, tf.opacity.points), tf.color)
    values = np.linspace(lo, hi, 500)
    np.testing.assert_allclose(
        window.state.transfer_function.opacity(values), exact.opacity(values), atol=1e-9
    )
    # One step, which can be undone; then it is said again.
    open_over(qtbot, window, window.state.edits.undo)
    assert window.state.transfer_function == tf
    assert "finer" in window.notice.text
    window.notice.clear()
    # Once dismissed, it is not said again of the same part.
    recolored = TransferFunction(tf.opacity, ColorTF(WIDE, ((0.0, 1, 0, 0), (65_535.0, 0, 1, 0))))
    window.state.tf_input.set(recolored, "edit")
    assert window.notice.text == ""
    window.state.tf_input.set(TransferFunction(KINDS["a band of a wide range"], tf.color), "edit")
    assert "finer" in window.notice.text
    # Whatever its kind, the same picture comes back.
    saved = tmp_path / "tf.json"
    for kind, opacity in KINDS.items():
        tf = TransferFunction(opacity, colors(opacity.scalar_range))
        open_over(qtbot, window, lambda tf=tf: window.state.tf_input.set(tf, "edit"))
        before = picture(window)
        window.state.transfer_function.save(saved)
        open_over(qtbot, window, window.state.reset_transfer_function)
        assert window.state.transfer_function != tf, kind
        open_over(qtbot, window, lambda: window.files.open_transfer_function(saved))
        assert window.state.transfer_function == tf, kind
        np.testing.assert_array_equal(picture(window), before, err_msg=kind)
