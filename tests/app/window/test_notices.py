from functools import partial
from itertools import combinations

import pytest
from mouse_events import action, drag
from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtGui import QPixmap
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLabel, QPushButton, QVBoxLayout, QWidget
from ramp import make_tf, make_volume
from rested_window import act_until, open_volume

from app import controls
from app.controls import Action
from app.image_view.orientation_cube import OrientationCube
from app.state.sensitivity_state import SensitivityState
from app.window.cards import CropCard
from app.window.notices import BOTTOM, SIDE, TOOLS_END, TOP, Floating, Notices
from app.window.status_line import StatusLine
from model.scene.crop import CropBox
from model.scene.view import AXES
from model.volume_files.shipped import shipped_volumes


@pytest.fixture
def bar(qtbot):
    window = QWidget()
    window.resize(520, 400)
    bar = Notices()
    column = QVBoxLayout(window)
    column.addWidget(bar)
    column.addStretch()
    qtbot.addWidget(window)
    with qtbot.waitActive(window):
        window.show()
        window.activateWindow()
    yield bar
    window.close()


def test_of_many_notices_the_newest_are_shown(bar):
    for number in range(5):
        bar.add(f"notice {number}")
    assert bar.text.splitlines() == [f"notice {number}" for number in (4, 3, 2, 1, 0)]

    def seen():
        return [line.text for line in bar._lines if line.isVisible()]

    assert seen() == ["notice 4", "notice 3", "notice 2"]
    assert bar.more.isVisible() and bar.more.text() == "and 2 more"
    assert bar.dismiss_newest()
    assert seen() == ["notice 3", "notice 2", "notice 1"]
    assert bar.more.text() == "and 1 more"
    bar.clear()
    assert not bar.dismiss_newest()


def test_a_screen_reader_says_errors_at_once(bar, monkeypatch):
    said = []
    monkeypatch.setattr(
        controls.QAccessible,
        "updateAccessibility",
        lambda event: said.append((event.message(), event.politeness().name)),
    )
    bar.add("It is found.")
    bar.add("It failed.", tone="error")
    assert said == [("It is found.", "Polite"), ("It failed.", "Assertive")]
    assert [line.property("tone") for line in bar._lines] == ["error", "plain"]
    assert bar._lines[0].accessibleName() == "Error: It failed."


def test_a_notice_replaces_the_one_of_its_key(bar):
    bar.add("no model", key="model")
    bar.add("an error")
    bar.add("another model", key="model")
    assert bar.text == "another model\nan error"
    bar.clear("model")
    bar.clear("unknown")
    assert bar.text == "an error"
    bar.add("no model", key="model")
    bar.add("")
    assert bar.text == "no model\nan error"
    bar.add("", key="model")
    assert bar.text == "an error"


def test_a_button_acts_once_and_escape_dismisses_one_after_another(qtbot, bar):
    seen = []
    bar.add("below")
    bar.add(
        "found",
        Action("Open", lambda: seen.append(bar.text)),
        Action("Locate…", partial(bar.add, "located")),
    )
    buttons = {b.text(): b for b in bar.findChildren(QPushButton) if b.isVisible()}
    assert [*buttons] == ["Open", "Locate…"]
    qtbot.mouseClick(buttons["Open"], Qt.MouseButton.LeftButton)
    assert seen == ["below"] and bar.text == "below"
    bar.add("two")
    bar.add("one", Action("Act", list))
    bar.image = bar.window()
    bar.findChildren(QPushButton)[-1].setFocus()
    for left in ("two\nbelow", "below", ""):
        qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Escape)
        assert bar.text == left
    assert not bar.isVisible() and bar.window().hasFocus()


@pytest.fixture
def area(qtbot):
    area = QWidget()
    qtbot.addWidget(area)
    area.resize(1000, 356)
    area.show()
    return area


def floated(floating, where, width, height):
    card = QLabel()
    card.setPixmap(QPixmap(width, height))
    floating.add(where, card)
    card.show()
    return card


def test_what_floats_is_in_the_area_and_nothing_lies_over_another(area):
    floating = Floating(area)
    notices = [floated(floating, "top", 480, 50), floated(floating, "top", 300, 40)]
    cards = [floated(floating, "bottom", 400, 120), floated(floating, "bottom", 320, 100)]
    for size, top in (((1000, 356), TOP), ((600, 500), TOP), ((520, 640), TOOLS_END[1])):
        area.resize(*size)
        boxes = [each.geometry() for each in (*notices, *cards)]
        assert all(area.rect().contains(box) for box in boxes)
        assert not any(one.intersects(other) for one, other in combinations(boxes, 2))
        assert boxes[0].top() == top and boxes[2].left() == SIDE
        # Nothing moves when one is closed, or opened again.
        for shown in (False, True):
            cards[0].setVisible(shown)
            assert cards[1].geometry() == boxes[3]


def test_a_card_is_dragged_stays_in_the_area_and_goes_back(qtbot, area):
    card = floated(Floating(area), "bottom", 320, 100)
    begun, left = card.geometry(), Qt.MouseButton.LeftButton
    grip = QPoint(20, 10)

    drag(card, grip, grip + QPoint(200, -50))
    assert card.geometry() == begun.translated(200, -50)
    drag(card, grip, grip + QPoint(2000, 2000))
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    area.resize(700, 300)
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    card.hide()
    card.show()
    assert card.geometry().bottomRight() == area.rect().bottomRight()
    QTest.mouseDClick(card, left, pos=grip)
    assert card.geometry() == QRect(SIDE, 300 - BOTTOM - 100, 320, 100)


def test_a_sentence_goes_after_a_time_or_what_it_is_about_unless_that_is_under_way(qtbot, state):
    line = StatusLine(state, SensitivityState())
    qtbot.addWidget(line)
    line.resize(1200, 24)
    line.show()
    line._rest.setInterval(20)
    line.say("Reading a.nrrd …")
    assert line.news == "Reading a.nrrd …" and not line._rest.isActive()
    line.say("Saved a.png.")
    assert line.news == "Saved a.png."
    qtbot.waitUntil(lambda: line.news == "")
    line.say("Opened a.json.")
    state.edits.undo()
    assert line.news == ""
    line.say("Reading a.nrrd …")
    state.edits.undo()
    assert line.news == "Reading a.nrrd …"


LEFT, PLAIN = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
DIMENSIONS = (101, 51, 21)
BOX = CropBox((0.2, 0.0, 0.5), (0.6, 1.0, 0.75))


@pytest.fixture
def crop_card(qtbot, state):
    crop_card = CropCard(state)
    qtbot.addWidget(crop_card)
    crop_card.resize(1200, crop_card.height())
    crop_card.set_volume(DIMENSIONS)
    crop_card.set_shown(True)
    qtbot.waitActive(crop_card)
    return crop_card


def at(slider, value):
    knob = 9
    return QPoint(round(knob / 2 + value * (slider.width() - knob)), slider.height() // 2)


def type_into(box, text):
    box.selectAll()
    QTest.keyClicks(box, text)
    QTest.keyClick(box, Qt.Key.Key_Return)


def shown(crop_card):
    return [(first.value(), last.value()) for first, last in crop_card.planes]


def test_typed_voxels_are_planes_through_their_centers(qtbot, state, crop_card):
    both = [state.crop_input.changed, state.crop_input.changeFinished]
    with qtbot.waitSignals(both, order="strict"):
        type_into(crop_card.planes[0][0], "26")
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 1.0))
    type_into(crop_card.planes[2][1], "11")
    assert state.crop == CropBox((0.25, 0.0, 0.0), (1.0, 1.0, 0.5))
    assert not state.live
    type_into(crop_card.planes[0][0], "1")
    type_into(crop_card.planes[2][1], "21")
    assert state.crop is None
    # Planes between voxels stay until their own number is typed.
    state.crop_input.set(CropBox((0.123, 0.0, 0.0), (0.9, 1.0, 1.0)))
    assert shown(crop_card)[0] == (13, 91)
    type_into(crop_card.planes[0][1], "81")
    assert state.crop == CropBox((0.123, 0.0, 0.0), (0.8, 1.0, 1.0))


def test_an_end_is_dragged_live(qtbot, state, crop_card):
    slider = crop_card.sliders[1]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 1.0))
    assert state.crop is None
    QTest.mouseMove(slider, at(slider, 0.5))
    assert state.live
    assert state.crop.high[1] == pytest.approx(0.5, abs=0.02)
    assert shown(crop_card)[1] == (1, 26)
    # No nearer than a voxel.
    QTest.mouseMove(slider, at(slider, 0.0))
    assert state.crop.high[1] - state.crop.low[1] == pytest.approx(1 / 50)
    with qtbot.waitSignal(state.crop_input.changeFinished):
        QTest.mouseRelease(slider, LEFT, PLAIN, at(slider, 0.0))
    assert not state.live
    # A slab keeps its thickness at the border.
    state.crop_input.set(BOX)
    slider = crop_card.sliders[0]
    QTest.mousePress(slider, LEFT, PLAIN, at(slider, 0.4))
    for target, low in ((0.5, 0.3), (3.0, 0.6), (-3.0, 0.0)):
        QTest.mouseMove(slider, at(slider, target))
        assert state.crop.low[0] == pytest.approx(low, abs=0.02)
        assert state.crop.high[0] - state.crop.low[0] == pytest.approx(0.4)
    # Hiding ends a drag and keeps the box.
    act_until(qtbot, state.crop_input.changeFinished, QTest.mouseClick, crop_card.dismiss, LEFT)
    QTest.mouseRelease(slider, LEFT)
    assert not crop_card.isVisible() and not crop_card.is_shown
    assert state.crop is not None and not state.live


def test_it_is_asked_once_with_pictures(qtbot, make_window, builders):
    window = make_window()
    card = window.up_axis_card
    assert card.isVisible()
    # Next to the browser there is no room, but it remains open.
    for browses in (True, False):
        window.latent_state.choose(shown=browses)
        assert card.isVisible() != browses

    def asked():
        return [r for r in builders.analysts[-1].others if r.channel == "up axis"]

    def level(axis):
        return card.buttons[axis].icon().pixmap(8, 8).toImage().pixelColor(4, 4).red()

    # The fake's images are each brighter than the one before.
    qtbot.waitUntil(lambda: level(AXES[-1]) > level(AXES[1]) > 0)
    # The reference may have drawn the first ones.
    qtbot.waitUntil(lambda: bool(asked()) and 1 + len(asked()[-1].more) == len(AXES))
    # The pictures follow the TF.
    window.state.tf_input.set(make_tf(), "preset")
    qtbot.waitUntil(lambda: asked()[-1].inputs.opacity_tf == make_tf().opacity)
    card.buttons["-y"].click()
    assert window.state.up_axis == "-y" and card.isHidden()
    builders.volumes["other"] = make_volume("other", 300.0)
    open_volume(qtbot, window, "other")
    assert card.isVisible() and window.state.up_axis == "+z"
    window.latent_state.choose(shown=True)
    assert card.isHidden()
    window.latent_state.choose(shown=False)
    open_volume(qtbot, window, "ramp")
    assert card.isHidden() and window.state.up_axis == "-y"
    # Who leaves it, or chooses an axis elsewhere, is not asked again.
    for name, answer in (
        ("third", window.up_axis_card.leave.click),
        ("fourth", lambda: window.state.set_up_axis("-x")),
    ):
        builders.volumes[name] = make_volume(name, 400.0 + len(name))
        open_volume(qtbot, window, name)
        assert card.isVisible()
        answer()
        axis = window.state.up_axis
        open_volume(qtbot, window, "ramp")
        open_volume(qtbot, window, name)
        assert card.isHidden() and window.state.up_axis == axis
    # The pictures' views wait for a volume's first image.
    window.workspace.reference.has_drawn = False
    card.ask()
    assert not card._views


def test_a_window_without_a_volume_offers_some(qtbot, make_window, builders):
    window = make_window(volume="lost", model=None)
    card, canvas = window.empty_card, window.reference.canvas
    assert "missing" in canvas.message
    assert card.isVisible() and canvas.rect().contains(card.geometry())
    assert len(card.samples) == len(shipped_volumes())
    # What would do nothing says so.
    assert not window.tools.isEnabled() and not window.editor.isEnabled()
    for name in ("Crop box", "Face the viewer", "Rectangle", "Compare with B"):
        window.status.say("")
        action(window, name).trigger()
        assert window.status.news == "Open a volume first."
    assert not (window.crop_card.is_shown or window.tools.crop.isChecked())
    assert window.sensitivity_state.tool is None
    window.status.say("")
    assert not any(cube.isVisible() for cube in window.findChildren(OrientationCube))
    assert window.status.keys == "[Ctrl O] open a volume"
    assert not window.reference.caption.isVisible() and not window.status.view.isVisible()
    name = shipped_volumes()[0].stem
    builders.volumes[name] = make_volume(name)
    card.samples[0].click()
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.windowTitle().startswith(name)
    assert card.isHidden() and window.tools.isEnabled() and window.reference.caption.isVisible()
    assert window.status.keys.startswith("[Drag] turn")
    assert any(cube.isVisible() for cube in window.findChildren(OrientationCube))
