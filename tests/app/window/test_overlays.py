import numpy as np
import pytest
from PySide6.QtCore import QPoint
from PySide6.QtGui import QAction, QImage

from app.image_view.engine_pane import OUTSIDE
from app.image_view.image_canvas import to_qimage
from app.state import generator_work
from app.window.figure import FigureChoice
from model.scene.view import View


def action(window, keys):
    (found,) = [a for a in window.findChildren(QAction) if a.shortcut().toString() == keys]
    return found


def grays(picture):
    pixels = ((x, y) for x in range(picture.width()) for y in range(picture.height()))
    return {picture.pixelColor(x, y).value() for x, y in pixels}


def test_opacity_images_lie_in_the_corner(make_window, builders):
    builders.draws_codes = True
    window = make_window()
    opacity = action(window, "Shift+O")
    generator, reference, _ = window.overlays.insets
    assert not opacity.isChecked() and generator.picture is None
    before = window.generator.canvas.grab().toImage()
    opacity.trigger()
    assert opacity.isChecked() and window.overlays.has("opacity_images")
    # The fakes' images are opaque everywhere.
    assert grays(generator.picture) == grays(reference.picture) == {255}
    square = window.generator.canvas.picture_rect
    at = square.left() + 40, square.bottom() - 60
    shown = window.generator.canvas.grab().toImage()
    assert before.pixelColor(*at).lightness() < 100 < 250 < shown.pixelColor(*at).lightness()
    # Another image brings its own.
    rgba = np.full((16, 16, 4), 0.5, np.float32)
    rgba[..., 3] = 0.2
    window.generator.rgba = rgba
    window.generator.imageShown.emit(window.state.inputs, rgba)
    assert grays(generator.picture) == {51}
    opacity.trigger()
    assert generator.picture is None
    assert window.generator.canvas.grab().toImage().pixelColor(*at) == before.pixelColor(*at)


def test_a_background_lies_behind_the_images_and_behind_a_figure(make_window):
    window = make_window()
    pane, rgba = window.reference, np.zeros((16, 16, 4), np.float32)
    # The left half is empty, the right half is opaque and red.
    rgba[:, 8:] = (1.0, 0.0, 0.0, 1.0)
    (black,) = [a for a in window.findChildren(QAction) if a.text() == "Black"]
    assert black.isChecked() and pane.canvas.background == (0, 0, 0)
    found = {}
    for name in ("White", "Gradient"):
        (choice,) = [a for a in window.findChildren(QAction) if a.text() == name]
        choice.trigger()
        assert choice.isChecked()
        pane.canvas.replace_image(pane._picture(rgba))
        rect, shown = pane.canvas.picture_rect, pane.canvas.grab().toImage()
        xs = rect.left() + rect.width() // 4, rect.left() + 3 * rect.width() // 4
        ys = rect.top() + rect.height() // 3, rect.top() + 3 * rect.height() // 4
        assert all(shown.pixelColor(xs[1], y).getRgb()[:3] == (255, 0, 0) for y in ys)
        found[name] = [shown.pixelColor(xs[0], y).value() for y in ys]
        assert window.saving.first_choice().background == pane.canvas.background
    assert found["White"] == [255, 255]
    assert 20 < found["Gradient"][1] < found["Gradient"][0] < 130


def test_the_error_is_that_of_the_square_of_the_same_inputs_and_shows_where_it_is(
    qtbot, make_window, monkeypatch
):
    window = make_window()
    canvas, inputs = window.generator.canvas, window.state.inputs

    def color(x, y):
        place = canvas.image_rect
        at = QPoint(
            place.left() + round(x * place.width()), place.top() + round(y * place.height())
        )
        return canvas.grab().toImage().pixelColor(at)

    drawn = np.full((16, 16, 4), 0.5, np.float32)
    truth = np.full((32, 32, 4), 0.5, np.float32)
    truth[:16, :16] = 0.3
    window.generator.imageShown.emit(inputs, drawn)
    canvas.show_image(to_qimage(drawn))
    window.reference.imageShown.emit(inputs, truth)
    plain = color(0.25, 0.25)
    assert plain == color(0.75, 0.25)
    window.image_error.set_wanted(not window.image_error.is_wanted)
    assert color(0.25, 0.25).value() > color(0.75, 0.25).value()
    # It stays wanted, but is not shown of another image.
    window.state.move_view(View(80.0))
    assert color(0.25, 0.25) == plain
    window.state.set_view(inputs.view)
    window.reference.imageShown.emit(inputs, truth)
    assert color(0.25, 0.25) != plain
    window.image_error.set_wanted(not window.image_error.is_wanted)
    assert color(0.25, 0.25) == plain
    drawn = np.full((16, 16, 4), 0.5, np.float32)
    truth = np.zeros((32, 64, 4), np.float32)
    truth[:, 16:48] = 0.5
    truth[:16, 16:48] = 0.3
    window.generator.imageShown.emit(inputs, drawn)
    window.reference.imageShown.emit(inputs, truth)
    # Half of the square is .2 off, but for the seam between the halves.
    error = float(window.generator.note.removeprefix("error "))
    assert error == pytest.approx(np.sqrt(0.5) * 0.2, abs=0.01)
    assert OUTSIDE not in window.generator.status
    monkeypatch.setattr(generator_work, "recorded_error", lambda _folder: 0.09)
    window.reference.imageShown.emit(inputs, truth)
    # As much as one and a half times what the model's test images have.
    assert OUTSIDE in window.generator.status
    window.state.move_view(View(70.0))
    assert window.generator.note == ""
    window.reference.imageShown.emit(window.state.inputs, truth)
    # While something moves, and of other inputs, nothing is compared.
    assert window.generator.note == ""
    window.state.finish_view()
    window.generator.imageShown.emit(window.state.inputs, drawn)
    window.reference.imageShown.emit(inputs, truth)
    assert window.generator.note == ""
    # Nor are images under different light.
    window.workspace.reference.choose(lighting="soft")
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.generator.imageShown.emit(window.state.inputs, np.zeros((16, 16, 4), np.float32))
    assert window.generator.note == ""


def test_a_saved_difference_is_that_of_the_screen(qtbot, make_window, tmp_path):
    window = make_window()
    canvas, inputs = window.generator.canvas, window.state.inputs

    def image(size, off):
        """A function of the place, in the middles of pixels; in the left half off by some."""
        x = (np.arange(size) + 0.5) / size
        gray = 0.5 + 0.3 * np.sin(9 * x)[:, None] * np.cos(7 * x) + off * (x < 0.5)
        return np.repeat(gray[..., None], 4, axis=2).astype(np.float32)

    window.generator.imageShown.emit(inputs, image(32, 0.1))
    window.reference.imageShown.emit(inputs, image(256, 0.0))
    canvas.show_image(to_qimage(image(32, 0.1)))
    # The finer image is compared where the generator's pixels have their middles.
    assert float(window.generator.note.removeprefix("error ")) == pytest.approx(0.071, abs=0.001)
    window.image_error.set_wanted(True)
    place = tmp_path / "difference.png"
    window.saving.draw(FigureChoice(512, 512, which="difference"), place)
    qtbot.waitUntil(place.exists)
    saved, screen, rect = QImage(str(place)), canvas.grab().toImage(), canvas.image_rect
    for x, y in ((0.2, 0.3), (0.4, 0.6), (0.6, 0.3), (0.8, 0.7)):
        at = rect.left() + round(x * rect.width()), rect.top() + round(y * rect.height())
        colors = screen.pixelColor(*at), saved.pixelColor(round(512 * x), round(512 * y))
        one, other = (np.array(color.getRgb()) for color in colors)
        # Pixels are enlarged in two ways.
        assert np.abs(one - other).max() <= 6
    # Of images that do not show the same there is no difference.
    window.state.set_view(View(80.0))
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    window.generator.imageShown.emit(inputs, image(32, 0.1))
    assert "difference" not in window.saving.sizes()
    window.saving.draw(FigureChoice(512, 512, which="difference"), tmp_path / "none.png")
    assert "no difference" in window.notice.text
