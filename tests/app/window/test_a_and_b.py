"""A and B side by side: from keys and mouse to images, difference, files and figures."""

from dataclasses import replace

import imageio.v3 as iio
import numpy as np
import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from ramp import make_tf, make_volume
from rested_window import act_until, follow_pane, open_volume, press, rested, saved_figure, settle

from app.engines.requests import IMAGES_B
from app.picture import pixels_of
from app.window.figure import FigureChoice, panels
from app.window.main_window import MainWindow
from model.scene.ranges import fit_to_range
from model.scene.scene import LightDirection

LEFT = Qt.MouseButton.LeftButton
CTRL_SHIFT = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
OTHER, LIGHT = make_tf(140.0), LightDirection(50.0, 10.0)


@pytest.fixture
def window(qtbot, make_window):
    """A window without a model, in which B is shown next to A."""
    window = rested(qtbot, make_window)
    compare(qtbot, window)
    return window


def compare(qtbot, window):
    press(qtbot, window, Qt.Key.Key_A)
    qtbot.waitUntil(lambda: window.pane_b.canvas.image is not None)
    follow_pane(qtbot, window)


def lights(window):
    return [window.state.inputs_of(pane).light for pane in "AB"]


def set_tf(qtbot, window, tf):
    window.state.tf_input.set(tf, "another")
    settle(qtbot, window)


def edited(window):
    """The pane that has a frame, what the editor's header says, and the pane in the state."""
    (framed,) = [pane.name for pane in window.context.panes if pane.canvas.is_edited]
    return framed, window.editor.pane_button.title, window.state.tf_input.pane


def test_what_is_edited_is_the_pane_that_was_clicked(qtbot, window, builders):
    a, first = window.reference.canvas, window.state.transfer_function
    assert edited(window) == ("B", "TF of B", "B")
    controls = *window.editor.header_controls, *window.sensitivity.chips.controls
    places = [each.mapTo(window, QPoint()) for each in controls]
    assert [pane.caption.title for pane in window.panes.images] == ["A", "B"]
    drawn = builders.references[-1].requests
    count = len(drawn)
    set_tf(qtbot, window, OTHER)
    # B alone is drawn anew.
    assert {r.channel for r in drawn[count:]} == {IMAGES_B}
    assert drawn[-1].inputs == window.state.inputs_of("B") != window.state.inputs_of("A")
    QTest.mouseClick(a, LEFT, pos=a.rect().center())
    assert edited(window) == ("A", "TF of A", "A") and window.state.transfer_function == first
    QTest.keyClick(a, Qt.Key.Key_A, Qt.KeyboardModifier.ShiftModifier)
    assert edited(window)[0] == "B" and window.pane_b.canvas.hasFocus()
    QTest.keyClick(a, Qt.Key.Key_A, Qt.KeyboardModifier.ShiftModifier)
    assert edited(window)[0] == "A"
    # By the left button its menu opens, too.
    QTest.mouseClick(window.pane_b.caption, Qt.MouseButton.RightButton)
    assert edited(window) == ("B", "TF of B", "B")
    window.reference.canvas.setFocus(Qt.FocusReason.TabFocusReason)
    assert edited(window)[0] == "A"
    # The view is that of both.
    count = len(drawn)
    QTest.keyClick(a, Qt.Key.Key_Left)
    settle(qtbot, window)
    final = {r.channel: r.inputs for r in drawn[count:] if not r.quality.live}
    assert {inputs.view for inputs in final.values()} == {window.state.view} and len(final) == 2
    # Closed, it is asked for no more, and what it was comes back.
    QTest.keyClick(window, Qt.Key.Key_C)
    count = len(drawn)
    set_tf(qtbot, window, make_tf(120.0))
    assert IMAGES_B not in {r.channel for r in drawn[count:]}
    assert window.panes.images == [window.reference]
    assert window.reference.caption.title == "Direct light"
    assert window.editor.pane_button.isHidden() and not window.reference.canvas.is_edited
    assert [each.mapTo(window, QPoint()) for each in controls] == places
    compare(qtbot, window)
    assert window.state.transfer_function == OTHER


def test_b_has_a_light_of_its_own(qtbot, window, builders, tmp_path, monkeypatch):
    a, controls = builders.references[-1], window.reference_controls
    work = window.workspace.reference
    first = window.state.tf_input.of("A")

    def choose(lighting):
        controls._lights[lighting].trigger()
        follow_pane(qtbot, window)

    def shown():
        titles = [pane.caption.title for pane in window.panes.images]
        return *titles, controls.light.title

    assert shown() == ("A", "B", "B: Direct") and window.pane_b.note
    controls._lights["path"].trigger()
    # Nothing is said of images until those in this light are there.
    assert not window.pane_b.note
    follow_pane(qtbot, window)
    assert window.pane_b.note
    b = builders.references[-1]
    assert b is not a and builders.settings[-1].lighting == "path" and not a.closed
    assert b.requests[-1].inputs == window.state.inputs_of("B")
    assert shown() == ("A, direct light", "B, path-traced light", "B: Path traced")
    drawn = []
    for engine in (a, b):

        def picture(request, watch, engine=engine, draw=engine.picture):
            drawn.append(engine)
            return draw(request)

        monkeypatch.setattr(engine, "picture", picture)
    saved_figure(qtbot, window, FigureChoice(920, 300, which="a_b"), tmp_path / "both.png")
    assert drawn == [a, b]
    # The other pane's, which leaves B as it is.
    window.state.tf_input.focus("A")
    choose("soft")
    assert shown() == ("A, soft light", "B, path-traced light", "A: Soft")
    window.state.edits.undo()
    window.state.edits.undo()
    follow_pane(qtbot, window)
    assert shown() == ("A", "B", "A: Direct")
    window.state.edits.redo()
    work.swap()
    follow_pane(qtbot, window)
    assert shown() == ("A, path-traced light", "B, direct light", "A: Path traced")
    window.state.edits.undo()
    work.copy("A")
    follow_pane(qtbot, window)
    assert shown() == ("A", "B", "B: Direct") and window.state.tf_input.of("B") == first
    choose("path")
    # Closed, nothing of it is left.
    b = builders.references[-1]
    QTest.keyClick(window, Qt.Key.Key_C)
    qtbot.waitUntil(lambda: b.closed)
    (left,) = [engine for engine in builders.references if not engine.closed]
    qtbot.waitUntil(lambda: left.forgotten == IMAGES_B)
    assert window.pane_b.rgba is None is window.pane_b.canvas.image


def test_renderers_that_were_exchanged_come_back(qtbot, window, builders):
    work, tf_input = window.workspace.reference, window.state.tf_input
    work.choose_look(drawing="vtk")
    settle(qtbot, window)
    work.swap()
    assert (work.choices.drawing, tf_input.look.drawing) == ("vtk", "raycast")
    window.state.edits.undo()
    assert (work.choices.drawing, tf_input.look.drawing) == ("raycast", "vtk")
    window.state.edits.redo()
    assert (work.choices.drawing, tf_input.look.drawing) == ("vtk", "raycast")
    work.choose(drawing="raycast")
    # Alike, both are one engine's.
    work.choose_look(drawing="vtk")
    settle(qtbot, window)
    b = builders.references[-1]
    work.choose_look(drawing="raycast")
    qtbot.waitUntil(lambda: b.closed)


def test_what_b_cannot_be_drawn_by_and_an_image_that_fails_are_said_there(qtbot, window, builders):
    canvas = window.pane_b.canvas
    builders.references[-1].error = ValueError("no memory")
    window.state.tf_input.set(OTHER, "another")
    qtbot.waitUntil(lambda: "no memory" in canvas.message)
    assert not window.reference.canvas.message
    builders.references[-1].error = None
    window.state.edits.undo()
    qtbot.waitUntil(lambda: not canvas.message)
    builders.failing = "soft"
    window.workspace.reference.choose_look(lighting="soft")
    qtbot.waitUntil(lambda: "no light" in canvas.message)
    window.pane_b._be_late()
    assert not window.pane_b._patience.isActive() and window.pane_b.caption.detail == "failed"
    assert window.reference.caption.detail != "failed" and not window.reference.canvas.message
    assert not window.errors and window.image_error.compared is None and not window.pane_b.note
    # In one image, too.
    QTest.keyClick(window, Qt.Key.Key_W, CTRL_SHIFT)
    said = window.reference.canvas.grab().toImage()
    canvas.message = ""
    assert window.reference.canvas.grab().toImage() != said
    window.state.edits.undo()
    qtbot.waitUntil(lambda: window.pane_b.note == "same as A" and not canvas.message)


def test_a_click_that_gives_the_focus_asks_nothing(qtbot, window):
    canvases = [pane.canvas for pane in window.panes.images]
    labels, asked = window.sensitivity.labels[1:], window.sensitivity_state
    for count in (0, 1):
        QTest.mouseClick(canvases[0], LEFT, pos=canvases[0].rect().center())
        assert window.state.tf_input.pane == "A" and (asked.place is not None) == bool(count)
    assert [label.is_here for label in labels] == [True, False]
    # The other pane's values at that place.
    QTest.mouseClick(canvases[1], LEFT, pos=canvases[1].rect().center() / 2)
    assert [label.is_here for label in labels] == [False, True]
    assert asked.place == pytest.approx((0.5, 0.5), abs=0.01)


def test_b_goes_along_to_the_next_time_step(qtbot, window, builders):
    set_tf(qtbot, window, OTHER)
    window.workspace.reference.choose_look(lighting="soft")
    first = window.state.tf_input.of("A")
    builders.volumes["ramp2"] = later = make_volume("ramp2", 250.0)
    builders.volumes["other"] = make_volume("other", 240.0)
    open_volume(qtbot, window, "ramp2")
    tf_input = window.state.tf_input
    assert window.panes.compares and window.workspace.reference.settings_b.lighting == "soft"
    shown = [tf_input.of(name) for name in "AB"]
    assert shown == [fit_to_range(tf, tf_input.value.scalar_range) for tf in (first, OTHER)]
    assert tf_input.value.scalar_range == later.scalar_range
    open_volume(qtbot, window, "other")
    assert not window.panes.compares


def test_b_takes_the_place_of_the_generator(qtbot, make_window, builders):
    window = make_window()
    compare(qtbot, window)
    assert window.panes.images == [window.reference, window.pane_b]
    # The map has the place of both.
    window.latent_state.choose(shown=True)
    assert window.panes.images == [window.reference] and window.state.tf_input.pane == "A"
    # Nothing is asked about B, which the key brings back at once, and the end of the map, too.
    window.sensitivity_state.hover(130.0, effect=False)
    asker = window.workspace.sensitivity
    qtbot.waitUntil(lambda: asker.seen is not None)
    assert not asker._channels["seen_too"].is_pending and asker.seen_too is None
    window.sensitivity_state.hover(None)
    QTest.keyClick(window, Qt.Key.Key_A)
    assert window.panes.images == [window.reference, window.pane_b]
    for shown in (True, False):
        window.latent_state.choose(shown=shown)
    assert window.panes.images == [window.reference, window.pane_b]
    QTest.keyClick(window, Qt.Key.Key_C)
    assert window.panes.images == [window.generator, window.reference]
    assert window.reference.caption.title == "Ground truth"
    window.state.tf_input.compare(True)
    set_tf(qtbot, window, OTHER)
    window.state.tf_input.compare(False)
    window.latent_state.choose(shown=True)
    # What is undone is seen.
    window.state.edits.undo()
    assert window.panes.images == [window.reference, window.pane_b]
    assert window.status.news.startswith("You edit B now")
    window.state.tf_input.compare(False)
    assert window.status.news == ""
    window.state.tf_input.compare(True)
    # The map's end brings back no B of another volume.
    builders.volumes["other"] = make_volume("other")
    window.latent_state.choose(shown=True)
    open_volume(qtbot, window, "other")
    window.latent_state.choose(shown=False)
    assert window.pane_b.isHidden()


def test_questions_are_about_the_pane_with_the_focus(qtbot, window):
    state, asker = window.state, window.workspace.sensitivity
    set_tf(qtbot, window, OTHER)
    # Where values are visible is seen in both.
    window.sensitivity_state.hover(130.0, effect=False)
    canvases = [pane.canvas for pane in window.panes.images]
    qtbot.waitUntil(lambda: all(canvas.cover is not None for canvas in canvases))
    # One scale of colours: half as much is seen in B.
    asker.seen_too = replace(asker.seen_too, value=2 * asker.seen_too.value)
    a, b = window.sensitivity.exact, window.sensitivity.exact_b
    for cover in (a, b):
        cover.refresh()
    assert a.scale == b.scale == pytest.approx(2 * b._choose().value.max())
    window.panes.show_b(True, True)
    b.refresh()
    assert not a.bar.isHidden()
    window.panes.show_b(True, False)
    # An image of other proportions has no field over it.
    kept = a._images
    for part, is_covered in ((np.s_[:, ::2], False), (np.s_[:], True)):
        a._images = [(at, inputs, image[part]) for at, inputs, image in kept]
        a.refresh()
        assert (canvases[0].cover is not None) is is_covered
    asked = [asker.seen, asker.seen_too]
    assert [each.request.inputs for each in asked] == [state.inputs_of(name) for name in "BA"]
    window.sensitivity_state.keep(120.0, 140.0)
    # What an edit changes, in the pane that is edited.
    for name, (other, shown) in (("B", canvases), ("A", canvases[::-1])):
        state.tf_input.focus(name)
        qtbot.waitUntil(lambda: asker.field is not None and asker.field.is_of(state.inputs))
        qtbot.waitUntil(lambda a=other, b=shown: a.cover is None and b.cover is not None)


def test_the_difference_is_said_and_shown_over_b(qtbot, window):
    assert window.pane_b.note == "same as A"
    window.pane_b.canvas.progress = 0.5
    QTest.keyClick(window, Qt.Key.Key_D)
    # That is said until it is shown.
    assert window.pane_b.note == "difference follows when both images are complete"
    window.pane_b.canvas.progress = None
    window.image_error.compare()
    assert window.image_error.compared is not None and window.pane_b.note == "same as A"
    set_tf(qtbot, window, OTHER)
    found = window.image_error.compared
    # Fakes have a level of red for each TF.
    reds = [pane.rgba[0, 0, 0] for pane in (window.pane_b, window.reference)]
    np.testing.assert_allclose(found.difference, 0.2126 * (reds[0] - reds[1]), atol=1e-6)
    assert f"differs from A by {found.error:.3f}".replace(" 0.", " .") == window.pane_b.note
    assert not window.generator.note
    # Not while a finer image follows.
    for progress, is_said in ((0.5, False), (None, True)):
        window.pane_b.canvas.progress = progress
        window.image_error.compare()
        assert window.pane_b.note.startswith("differs") is is_said
    # Another focus changes neither image.
    for name in ("A", "B"):
        window.state.tf_input.focus(name)
        settle(qtbot, window)
        assert window.pane_b.note.startswith("differs") and window.image_error.shown
    window.state.tf_input.swap()
    settle(qtbot, window)
    swapped = window.image_error.compared.difference
    np.testing.assert_allclose(swapped, -found.difference, atol=1e-12)
    window.state.tf_input.compare(False)
    assert not window.image_error.is_wanted


def test_in_one_image_the_line_divides_a_from_b(qtbot, window):
    set_tf(qtbot, window, OTHER)
    QTest.keyClick(window, Qt.Key.Key_W, CTRL_SHIFT)
    settle(qtbot, window)
    a, line = window.reference.canvas, window.wipe
    follow_pane(qtbot, window)
    assert window.panes.images == [window.reference] and line.isVisible()
    # A figure begins with it.
    assert window.saving.first_choice().which == "wiped"
    assert window.saving.sizes()["wiped"] == a.pixels
    # B's image from before, which was narrower, is as high as A's, not as wide.
    canvas_b, narrow = window.pane_b.canvas, QPoint(a.width() - 20, a.height() // 2 + 60)
    whole, canvas_b.image = canvas_b.image, canvas_b.image.copy(0, 0, 20, canvas_b.image.height())
    assert a.grab().toImage().pixelColor(narrow).name() == "#000000"
    canvas_b.image = whole
    assert a.grab().toImage().pixelColor(narrow).name() != "#000000"
    for target in (0.2, 0.7):
        QTest.mousePress(line, LEFT, pos=line.rect().center())
        QTest.mouseMove(line, line.mapFrom(a, QPoint(round(target * a.width()), 50)))
        QTest.mouseRelease(line, LEFT)
        assert line.share == pytest.approx(target, abs=0.01)
        shown = a.grab().toImage()
        at, row = round(target * a.width()), a.height() // 2 + 60
        reds = [shown.pixelColor(at + step, row).red() for step in (-40, 40)]
        images = a.image, window.pane_b.canvas.image
        assert reds == [image.pixelColor(5, 5).red() for image in images]
    QTest.mouseClick(a, LEFT, pos=QPoint(round(0.9 * a.width()), 80))
    assert window.state.tf_input.pane == "B"
    QTest.mouseClick(a, LEFT, pos=QPoint(round(0.4 * a.width()), 80))
    assert window.state.tf_input.pane == "A"
    # So it divides A from the difference.
    before, row = a.grab().toImage(), a.height() // 2 + 60
    QTest.keyClick(window, Qt.Key.Key_D)
    qtbot.waitUntil(lambda: window.image_error.shown is not None)
    after, at = a.grab().toImage(), round(0.7 * a.width())
    assert line.isVisible() and before.pixelColor(at - 40, row) == after.pixelColor(at - 40, row)
    assert before.pixelColor(at + 40, row) != after.pixelColor(at + 40, row)
    # Both lie there, so that the label of values names its own.
    QTest.mouseClick(a, LEFT, pos=QPoint(round(0.4 * a.width()), row))
    labels = window.sensitivity.labels[1:]
    qtbot.waitUntil(lambda: ">In A<" in labels[0].text.text())
    window.state.tf_input.focus("B")
    assert [label.is_here for label in labels] == [True, False]
    # Next to each other, it goes over to its own.
    QTest.keyClick(window, Qt.Key.Key_W, CTRL_SHIFT)
    qtbot.waitUntil(lambda: [label.is_here for label in labels] == [False, True])


def test_sessions_and_the_next_run_bring_b_back(qtbot, start_again, builders, tmp_path):
    volume, path = tmp_path / "ramp", tmp_path / "a.tfscope"
    volume.touch()
    window = start_again(volume)
    window.resize(1000, 1400)
    window.show()
    follow_pane(qtbot, window)
    home = window.state.view
    window.state.tf_input.compare(True)
    follow_pane(qtbot, window)
    assert window.state.view == home != window.state.home
    window.workspace.reference.choose_look(lighting="soft")
    window.state.light_input.set(LIGHT)
    set_tf(qtbot, window, OTHER)
    saved = window.sessions.session()
    window.sessions.save(path)
    window.close()
    # It opens as it was left, though that was not made for the narrower panes.
    window = MainWindow(builders.make())
    qtbot.addWidget(window)
    window.resize(1000, 1400)
    window.show()
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    follow_pane(qtbot, window)
    assert window.state.view == home and window.up_axis_card.isHidden()
    window.close()
    window = start_again(volume)
    assert window.state.tf_input.of("B") == OTHER and window.panes.compares
    assert window.state.tf_input.pane == "B"
    assert window.workspace.reference.settings_b.lighting == "soft"
    assert lights(window) == [LightDirection(), LIGHT]
    window.workspace.reference.swap()
    assert lights(window) == [LIGHT, LightDirection()]
    # Copied, B's follows A's.
    window.workspace.reference.copy("A")
    window.state.edited["light"].set(LightDirection(9.0, 9.0))
    assert lights(window) == 2 * [LightDirection(9.0, 9.0)]
    for _ in range(3):
        window.state.edits.undo()
    assert lights(window) == [LightDirection(), LIGHT]
    window.workspace.reference.copy("A")
    window.state.tf_input.compare(False)
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)
    assert window.sessions.session() == saved and window.panes.compares


def _pixels(image):
    return pixels_of(image).astype(int)


def test_figures_have_both_with_one_legend(qtbot, window, builders, tmp_path, monkeypatch):
    set_tf(qtbot, window, OTHER)
    assert window.saving.first_choice().which == "a_b"
    wide, high = window.saving.sizes()["a_b_difference"]
    assert wide > 2.9 * window.reference.canvas.width() > high
    engine, asked = builders.references[-1], []

    def picture(request, watch):
        asked.append(request)
        shape = request.quality.pixels.shape
        is_b = request.inputs.opacity_tf == window.state.inputs_of("B").opacity_tf
        is_first = request.inputs.view == window.state.view
        level = 200 if is_b else 100 if is_first else 150
        return np.full((*shape, 4), (level, level, level, 255), np.uint8)

    monkeypatch.setattr(engine, "picture", picture)
    choice = FigureChoice(920, 300, legend=True, which="a_b_difference")
    saved = saved_figure(qtbot, window, choice, tmp_path / "both.png")
    assert {r.inputs for r in asked} == {window.state.inputs_of(name) for name in "AB"}
    # The legend of both lies to the right of all images, which are as wide as each other.
    ends = [panel.right() + 1 for panel in panels(choice)]
    assert 700 < ends[-1] < 800 and panels(choice)[0].width() == panels(choice)[2].width()
    _a, b, _difference, legend = np.split(np.ptp(_pixels(saved), axis=2), ends, axis=1)
    assert b.max() < 10 and legend.max() > 60
    # So do the colours of the difference, below them.
    below = np.split(_pixels(saved)[panels(choice)[0].bottom() + 1 :], ends, axis=1)
    assert below[0].max() == below[1].max() == 0 and np.ptp(below[2], axis=2).max() > 60
    # In the brightness of the light.
    a, b = (saved.pixelColor(x, 150).red() for x in (100, 380))
    assert 100 <= a < a + 50 < b
    # B is brighter everywhere: the colour of the upper end, not a grey.
    colors = saved.pixelColor(640, 150).getRgb()[:3]
    assert max(colors) - min(colors) > 20
    # Both turn together in a movie.
    asked.clear()
    window.saving.draw(replace(choice, seconds=0.5, rate=8), tmp_path / "both.gif")
    qtbot.waitUntil(lambda: "Saved" in window.status.news)
    frames = np.stack([frame[..., :3] for frame in iio.imiter(tmp_path / "both.gif")])
    # Half the difference of the first picture has not its colour.
    assert abs(np.diff(frames[:2, 150, 640].astype(int), axis=0)).max() > 20
    views, tfs = [r.inputs.view for r in asked], {r.inputs.opacity_tf for r in asked}
    assert len(views) == 8 and views[::2] == views[1::2] and len(set(views)) == 4 and len(tfs) == 2
