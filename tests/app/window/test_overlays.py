from dataclasses import replace

import numpy as np
import pytest
from mouse_events import action, at, drag
from PySide6.QtCore import QPoint, QPointF, QRect, QSize, Qt
from PySide6.QtTest import QTest

from app import theme
from app.image_view.engine_pane import HIGH
from app.image_view.image_canvas import to_qimage
from app.picture import pixels_of
from app.state import open_model
from app.window.figure import FigureChoice, figure
from model.rendering.ray_places import ray_places
from model.scene.transfer_function import OpacityTF
from model.scene.view import View


def grays(picture):
    pixels = ((x, y) for x in range(picture.width()) for y in range(picture.height()))
    return {picture.pixelColor(x, y).value() for x, y in pixels}


def test_opacity_images_lie_in_the_corner(make_window):
    window = make_window()
    opacity = action(window, "Opacity image")
    generator, reference, _ = window.overlays.insets
    assert not opacity.isChecked() and generator.picture is None
    before = window.generator.canvas.grab().toImage()
    opacity.trigger()
    assert opacity.isChecked() and window.overlays.has("opacity_images")
    # The fakes' images are opaque everywhere.
    assert grays(generator.picture) == grays(reference.picture) == {255}
    square = window.generator.canvas.picture_rect
    corner = square.left() + 40, square.bottom() - 60
    assert before.pixelColor(*corner).lightness() < 100
    assert window.generator.canvas.grab().toImage().pixelColor(*corner).lightness() > 250
    # Another image brings its own.
    rgba = np.full((16, 16, 4), 0.5, np.float32)
    rgba[..., 3] = 0.2
    window.generator.rgba = rgba
    window.generator.imageShown.emit(window.state.inputs, rgba)
    assert grays(generator.picture) == {51}
    opacity.trigger()
    assert generator.picture is None
    assert window.generator.canvas.grab().toImage().pixelColor(*corner).lightness() < 100
    opacity.trigger()
    # Of an image as wide as the window was, too, it is all in the pane.
    window.generator.canvas.replace_image(window.generator._picture(rgba.repeat(9, axis=1)))
    assert window.generator.canvas.rect().contains(generator.box.toRect())


def test_a_background_lies_behind_the_images_and_behind_a_figure(make_window):
    window = make_window()

    def copy(**other):
        choice = replace(window.saving.first_choice(), width=20, height=20, **other)
        window.saving.draw(choice, None)

    pane, rgba = window.reference, np.zeros((16, 16, 4), np.float32)
    # The left half is empty, the right half is opaque and red.
    rgba[:, 8:] = (1.0, 0.0, 0.0, 1.0)
    found = {}
    for name in ("White", "Gradient"):
        action(window, name).trigger()
        pane.canvas.replace_image(pane._picture(rgba))
        rect, shown = pane.canvas.picture_rect, pane.canvas.grab().toImage()
        xs = rect.left() + rect.width() // 4, rect.left() + 3 * rect.width() // 4
        ys = rect.top() + rect.height() // 3, rect.top() + 3 * rect.height() // 4
        assert all(shown.pixelColor(xs[1], y).getRgb()[:3] == (255, 0, 0) for y in ys)
        found[name] = [shown.pixelColor(xs[0], y).value() for y in ys]
        assert window.saving.first_choice().background == pane.canvas.background
        copy()
        # A message can be read on any.
        pane.canvas.show_message("The engine has failed.", theme.ON_IMAGE.error)
        middle = QRect(pane.canvas.rect().center() - QPoint(30, 5), QSize(60, 10))
        assert min(grays(pane.canvas.grab(middle).toImage())) < 30
        pane.canvas.show_message("")
    # One that was chosen for figures stays theirs.
    copy(background=None)
    action(window, "Black").trigger()
    assert window.saving.first_choice().background is None
    assert found["White"] == [255, 255]
    assert 20 < found["Gradient"][1] < found["Gradient"][0] < 130


def test_letters_over_an_image_are_the_window_s_at_any_size(make_window):
    window, heights = make_window(), []
    canvas = window.reference.canvas
    for size in ((1000, 700), (2000, 1400)):
        window.resize(*size)
        plain = canvas.grab().toImage()
        window.overlays.toggle("scale_bar")
        shown = canvas.grab().toImage()
        window.overlays.toggle("scale_bar")
        changed = (pixels_of(plain) != pixels_of(shown)).any(axis=(1, 2))
        heights.append(canvas.picture_rect.bottom() - np.argmax(changed))
    assert heights[0] == heights[1] < 3.5 * canvas.fontInfo().pixelSize()


def test_the_error_is_that_of_the_square_of_the_same_inputs_and_shows_where_it_is(
    qtbot, make_window, monkeypatch
):
    window = make_window()
    canvas, inputs = window.generator.canvas, window.state.inputs

    def color(x, y):
        return canvas.grab().toImage().pixelColor(at(canvas, x, y))

    drawn = np.full((16, 16, 4), 0.5, np.float32)
    truth = np.full((32, 32, 4), 0.5, np.float32)
    truth[:16, :16] = 0.3
    window.generator.imageShown.emit(inputs, drawn)
    canvas.show_image(to_qimage(drawn))
    window.reference.imageShown.emit(inputs, truth)
    plain = color(0.25, 0.25)
    assert plain == color(0.75, 0.25)
    window.image_error.is_wanted = not window.image_error.is_wanted
    assert color(0.25, 0.25).value() > color(0.75, 0.25).value()
    action(window, "White").trigger()
    assert color(0.25, 0.25).lightness() < color(0.75, 0.25).lightness() - 20
    # The scale's text has a dark ground.
    corner = canvas.image_rect.bottomRight() - QPoint(6, 26)
    assert canvas.grab().toImage().pixelColor(corner).lightness() < 150
    action(window, "Black").trigger()
    canvas.show_image(to_qimage(drawn))
    # It stays wanted, but is not shown of another image.
    window.state.move_view(View(80.0))
    assert color(0.25, 0.25) == plain
    window.state.set_view(inputs.view)
    window.reference.imageShown.emit(inputs, truth)
    assert color(0.25, 0.25) != plain
    # The ruler's line lies over it.
    before = canvas.grab().toImage()
    window.overlays.subject = replace(window.overlays.subject, line=((0.0,) * 3, (1.0,) * 3))
    assert canvas.grab().toImage() != before
    window.overlays.subject = replace(window.overlays.subject, line=())
    # Over a wide image, it is as wide: its left eighth lies outside of the square.
    wide = np.full((16, 32, 4), 0.5, np.float32)
    canvas.show_image(to_qimage(wide))
    window.generator.imageShown.emit(inputs, wide)
    window.reference.imageShown.emit(inputs, np.where(np.arange(32) < 4, 0.3, 0.5)[:, None] * wide)
    assert color(0.06, 0.25) == color(0.75, 0.25)
    canvas.show_image(to_qimage(drawn))
    window.generator.imageShown.emit(inputs, drawn)
    window.image_error.is_wanted = not window.image_error.is_wanted
    assert color(0.25, 0.25) == plain
    truth = np.zeros((32, 64, 4), np.float32)
    truth[:, 16:48] = 0.5
    truth[:16, 16:48] = 0.3
    window.generator.imageShown.emit(inputs, drawn)
    window.reference.imageShown.emit(inputs, truth)
    # Half of the square is .2 off.
    error = float(window.generator.note.removeprefix("error "))
    assert error == pytest.approx(np.sqrt(0.5) * 0.2, abs=0.01)
    assert HIGH not in window.generator.caption.detail
    monkeypatch.setattr(open_model, "recorded_error", lambda _folder: 0.09)
    window.reference.imageShown.emit(inputs, truth)
    # As much as one and a half times what the model's test images have.
    assert HIGH in window.generator.caption.detail
    window.state.move_view(View(70.0))
    assert window.generator.note == ""
    window.reference.imageShown.emit(window.state.inputs, truth)
    window.state.finish_view()
    window.generator.imageShown.emit(window.state.inputs, drawn)
    window.reference.imageShown.emit(inputs, truth)
    assert window.generator.note == ""
    # What keeps a wanted difference away is said as long as it does.
    window.image_error.is_wanted = True
    assert window.generator.note.startswith("difference follows")
    window.state.set_orthographic(True)
    assert window.generator.note == "no difference in an orthographic view"
    window.workspace.reference.choose(lighting="soft")
    assert window.generator.note.endswith("another light")
    window.image_error.is_wanted = False
    assert window.generator.note == ""


def click(canvas, x, y, *more):
    """Click on an image; return where that is, right and up from its middle."""
    for way in (QTest.mouseClick, *more):
        way(canvas, Qt.MouseButton.LeftButton, pos=at(canvas, x, y))
    x, y = canvas.place_of(QPointF(at(canvas, x, y)))
    return 2 * x - 1, 1 - 2 * y


def test_two_clicks_measure_the_distance_of_what_shows_there(make_window):
    window = make_window()
    state, canvas, overlays = window.state, window.reference.canvas, window.overlays
    measure = action(window, "Measure a distance")
    state.set_view(replace(state.view, roll=5.0))
    picked, view = window.sensitivity_state.place, state.view
    measure.trigger()
    # A double click is one place, and does not go home.
    places = [click(canvas, *place, QTest.mouseDClick) for place in ((0.45, 0.5), (0.6, 0.55))]
    volume = window.workspace.opened.volume
    points = [ray_places(volume, state.inputs, place)[0][0] for place in places]
    np.testing.assert_allclose(overlays.subject.line, points)
    expected = np.linalg.norm(np.subtract(*points) * volume.extent)
    assert f"{expected:.4g}" in window.status.news
    # Neither label nor view have followed the clicks, and now they do again.
    assert (window.sensitivity_state.place, state.view) == (picked, view)
    assert not window.ruler.is_on
    # A drag is its ends, and turns nothing.
    measure.trigger()
    drag(canvas, *(at(canvas, *place) for place in ((0.45, 0.5), (0.5, 0.5), (0.6, 0.55))))
    np.testing.assert_allclose(overlays.subject.line, points)
    assert state.view == view and not window.ruler.is_on
    # A figure has the line, too.
    images = {"reference": (np.zeros((300, 300, 4), np.float32), 1.0)}
    drawn = figure(FigureChoice(300, 300), images, state.inputs, overlays.subject)
    assert pixels_of(drawn).max() > 200
    drag(canvas, QPoint(100, 100), QPoint(130, 100), QPoint(140, 100))
    assert state.view != view
    assert len(overlays.subject.line) == 2
    # The line stays until there is another one, or Escape, which removes it last.
    kept = overlays.subject.line
    for clicks in (0, 1):
        measure.trigger()
        for _ in range(clicks):
            click(window.reference.canvas, 0.5, 0.5)
            assert len(overlays.subject.line) == 1
        QTest.keyClick(window, Qt.Key.Key_Escape)
        assert overlays.subject.line == kept
    window.crop_card.set_shown(True)
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert len(overlays.subject.line) == 2 and not window.crop_card.is_shown
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert overlays.subject.line == ()


def test_a_click_on_nothing_is_said_and_escape_ends_the_ruler(make_window):
    window = make_window()
    canvas, state = window.reference.canvas, window.state
    # In one image of A and B, each place is measured in what is drawn there.
    state.tf_input.compare(True)
    window.wipe.is_shown = True
    nothing = OpacityTF(state.scalar_range)
    state.tf_input.focus("B")
    state.tf_input.set(replace(state.transfer_function, opacity=nothing))
    window.ruler.toggle()
    click(canvas, 0.6, 0.5)
    assert "Nothing shows there" in window.status.news
    click(canvas, 0.4, 0.5)
    assert len(window.overlays.subject.line) == 1 and window.ruler.end()
    window.ruler.toggle()
    click(canvas, 0.01, 0.01)
    assert "Nothing shows there" in window.status.news
    click(canvas, 0.45, 0.5)
    assert len(window.overlays.subject.line) == 1
    # The first place of another volume is no second one.
    window.overlays.start_volume(replace(window.overlays.subject, line=()))
    click(canvas, 0.5, 0.5)
    assert len(window.overlays.subject.line) == 1
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert window.overlays.subject.line == () and not window.ruler.is_on


def test_the_orthographic_view_stays_until_it_is_left(make_window):
    window = make_window()
    state, orthographic = window.state, action(window, "Orthographic")
    assert orthographic.shortcut().toString() == "O"
    home = state.view
    state.set_view(replace(home, azimuth=20.0, pan_x=0.3))
    assert "pan" not in window.status.view.text()
    state.set_view(replace(state.view, pan_y=0.2))
    assert window.status.view.text().endswith("pan +.30, +.20")
    orthographic.trigger()
    assert state.view.is_orthographic and state.view.distance == home.distance
    assert window.status.view.text().endswith("orthographic")
    for change in (lambda: state.look_from("Top"), state.view_whole, state.reset_view):
        change()
        assert state.view.is_orthographic
    assert state.view == state.home
    assert "orthographic view" in window.generator.hint
    orthographic.trigger()
    assert state.view == home and not orthographic.isChecked()


def test_the_card_moves_and_removes_the_plane(make_window):
    window = make_window()
    state, card = window.state, window.crop_card
    action(window, "Face the viewer").trigger()
    assert card.is_shown and card.offset.isEnabled()
    before = state.clip
    card.offset.setValue(0.4)
    assert (state.clip.normal, state.clip.offset) == (before.normal, pytest.approx(0.4))
    assert "clipping plane" in window.generator.hint
    card.flip.click()
    assert state.clip.offset == pytest.approx(-0.4)
    card.uncut.click()
    assert state.clip is None and not card.flip.isEnabled()
    for offset in (-0.4, 0.4, before.offset, None):
        state.edits.undo()
        assert offset == (pytest.approx(state.clip.offset) if state.clip else None)
