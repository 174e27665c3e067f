from pathlib import Path

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from ramp import make_tf, make_volume
from rested_window import open_volume

from app.image_view.orientation_cube import OrientationCube
from app.window.cards import CropCard
from model.scene.crop import CropBox
from model.scene.view import AXES, View
from model.volume_files.shipped import shipped_volumes

LEFT, PLAIN = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
DIMENSIONS = (101, 51, 21)
BOX = CropBox((0.2, 0.0, 0.5), (0.6, 1.0, 0.75))


@pytest.fixture
def bar(qtbot, state):
    bar = CropCard(state)
    qtbot.addWidget(bar)
    bar.resize(1200, bar.height())
    bar.set_volume(DIMENSIONS)
    bar.set_shown(True)
    qtbot.waitActive(bar)
    return bar


def at(slider, value):
    knob = 9
    return QPoint(round(knob / 2 + value * (slider.width() - knob)), slider.height() // 2)


def type_into(box, text):
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def shown(bar):
    return [(first.value(), last.value()) for first, last in bar.planes]


def test_typed_voxels_are_planes_through_their_centers(qtbot, state, bar):
    with qtbot.waitSignals(
        [state.crop_input.changed, state.crop_input.changeFinished], order="strict"
    ):
        type_into(bar.planes[0][0], "25")
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 1.0))
    type_into(bar.planes[2][1], "10")
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 0.5))
    assert not state.live
    type_into(bar.planes[0][0], "0")
    type_into(bar.planes[2][1], "20")
    assert state.crop is None


def test_planes_between_voxels_stay_until_their_own_number_is_typed(state, bar):
    state.crop_input.set(CropBox((0.123, 0.0, 0.0), (0.9, 1.0, 1.0)))
    assert shown(bar)[0] == (12, 90)
    type_into(bar.planes[0][1], "80")
    assert state.crop == CropBox((0.123, 0.0, 0.0), (0.8, 1.0, 1.0))


def test_an_end_is_dragged_live(qtbot, state, bar):
    slider = bar.sliders[1]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 1.0))
    assert state.crop is None
    QTest.mouseMove(slider, at(slider, 0.5))
    assert state.live
    assert state.crop.high[1] == pytest.approx(0.5, abs=0.02)
    assert shown(bar)[1] == (0, 25)
    # No nearer than a voxel.
    QTest.mouseMove(slider, at(slider, 0.0))
    assert state.crop.high[1] - state.crop.low[1] == pytest.approx(1 / 50)
    with qtbot.waitSignal(state.crop_input.changeFinished):
        QTest.mouseRelease(slider, LEFT, PLAIN, at(slider, 0.0))
    assert not state.live


def test_a_slab_keeps_its_thickness_at_the_border(state, bar):
    state.crop_input.set(BOX)
    slider = bar.sliders[0]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 0.4))
    for target, low in ((0.5, 0.3), (3.0, 0.6), (-3.0, 0.0)):
        QTest.mouseMove(slider, at(slider, target))
        assert state.crop.low[0] == pytest.approx(low, abs=0.02)
        assert state.crop.high[0] - state.crop.low[0] == pytest.approx(0.4)
    QTest.mouseRelease(slider, LEFT, PLAIN, at(slider, -3.0))


def test_hiding_ends_a_drag_and_keeps_the_box(qtbot, state, bar):
    told = []
    bar.shownChanged.connect(told.append)
    slider = bar.sliders[0]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 0.0))
    QTest.mouseMove(slider, at(slider, 0.5))
    with qtbot.waitSignal(state.crop_input.changeFinished):
        QTest.mouseClick(bar.dismiss, LEFT)
    QTest.mouseRelease(slider, LEFT)
    assert told == [False]
    assert not bar.isVisible() and not bar.is_shown
    assert state.crop is not None
    bar.set_shown(True)
    bar.set_shown(True)
    assert told == [False, True]


def test_it_is_asked_once_with_pictures(qtbot, make_window, builders):
    window = make_window()
    bar = window.up_axis_card
    assert bar.isVisible()
    # Before there are pictures it is as high as with them.
    height = bar.sizeHint().height()

    def asked():
        return [r for r in builders.analysts[-1].others if r.channel == "up axis"]

    def level(axis):
        return bar.buttons[axis].icon().pixmap(8, 8).toImage().pixelColor(4, 4).red()

    # The fake's images are each brighter than the one before.
    qtbot.waitUntil(lambda: level(AXES[-1]) > level(AXES[1]) > 0)
    # The reference may have drawn the first ones.
    qtbot.waitUntil(lambda: bool(asked()))
    assert 1 + len(asked()[-1].more) == len(AXES)
    assert bar.sizeHint().height() == height
    # The pictures follow the TF.
    window.state.tf_input.set(make_tf(), "preset")
    qtbot.waitUntil(lambda: asked()[-1].inputs.opacity_tf == make_tf().opacity)
    bar.buttons["-y"].click()
    assert window.state.up_axis == "-y" and bar.isHidden()
    builders.volumes["other"] = make_volume("other", 300.0)
    open_volume(qtbot, window, "other")
    assert bar.isVisible() and window.state.up_axis == "+z"
    open_volume(qtbot, window, "ramp")
    assert bar.isHidden() and window.state.up_axis == "-y"
    # Who leaves it, or chooses an axis elsewhere, is not asked again.
    for name, answer in (
        ("third", window.up_axis_card.leave.click),
        ("fourth", lambda: window.state.set_up_axis("-x")),
    ):
        builders.volumes[name] = make_volume(name, 400.0 + len(name))
        open_volume(qtbot, window, name)
        assert bar.isVisible()
        answer()
        axis = window.state.up_axis
        open_volume(qtbot, window, "ramp")
        open_volume(qtbot, window, name)
        assert bar.isHidden() and window.state.up_axis == axis
    # It goes when the volume is turned, and after a while; the menu brings it back.
    window.up_axis_card.ask()
    window.state.set_view(View(azimuth=77.0))
    assert bar.isHidden()
    window.up_axis_card.ask()
    assert bar.isVisible()
    window.up_axis_card._unused.timeout.emit()
    assert bar.isHidden()


def test_a_window_without_a_volume_offers_some(qtbot, make_window, builders):
    window = make_window(volume="lost", model=None)
    card, canvas = window.empty_card, window.reference.canvas
    assert "missing" in canvas.message
    assert card.isVisible() and canvas.rect().contains(card.geometry())
    assert len(card.samples) == len(shipped_volumes())
    # What would do nothing says so.
    assert not window.tools.isEnabled() and not window.editor.isEnabled()
    assert not any(cube.isVisible() for cube in window.findChildren(OrientationCube))
    assert window.status.keys == "[Ctrl O] open a volume"
    name = shipped_volumes()[0].stem
    builders.volumes[name] = make_volume(name)
    card.samples[0].click()
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.windowTitle().startswith(name)
    assert card.isHidden() and window.tools.isEnabled()
    assert window.status.keys.startswith("[Drag] turn")
    assert any(cube.isVisible() for cube in window.findChildren(OrientationCube))
    # One that is there stays when another one cannot be read.
    window.files.open_volume(Path("lost"))
    qtbot.waitUntil(lambda: "missing" in window.notice.text)
    assert card.isHidden()
