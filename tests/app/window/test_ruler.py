"""Two clicks measure a distance; orthographic views and clipping planes from menus and card."""

from dataclasses import replace

import numpy as np
import pytest
from mouse_events import action, at, drag
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from app.window.figure import FigureChoice, figure, pixels_of
from model.rendering.ray_places import ray_places
from model.rendering.scale_bar import Scale
from model.scene.transfer_function import OpacityTF
from model.scene.view import Projection
from model.scene.volume import FileFacts, Volume


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
    # A figure has the line, too.
    images = {"reference": (np.zeros((300, 300, 4), np.float32), 1.0)}
    without = replace(overlays.subject, line=())
    one, other = (
        pixels_of(figure(FigureChoice(300, 300), images, state.inputs, subject))
        for subject in (overlays.subject, without)
    )
    ends = Projection(state.view, volume.proportions).places(np.array(points))
    middle = np.rint(150 + 150 * ends.mean(axis=0) * (1, -1)).astype(int)
    assert one[middle[1] - 1 : middle[1] + 2, middle[0] - 1 : middle[0] + 2].max() > 200
    assert other.max() == 0
    drag(canvas, QPoint(100, 100), QPoint(130, 100), QPoint(140, 100))
    assert state.view != view
    assert len(overlays.subject.line) == 2
    # The line stays until there is another one, or Escape.
    measure.trigger()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert len(overlays.subject.line) == 2
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert overlays.subject.line == ()


def test_a_click_on_nothing_is_said_and_escape_ends_the_ruler(make_window):
    window = make_window()
    canvas, state = window.reference.canvas, window.state
    # In one image of A and B, each place is measured in what is drawn there.
    state.tf_input.compare(True)
    window.wipe.set_shown(True)
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
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert window.overlays.subject.line == () and not window.ruler.is_on


@pytest.mark.parametrize(("spacing", "unit", "text"), [
    ((1.0, 1.0, 1.0), "", "voxels"), ((0.5, 0.5, 2.0), "", "units"),
    ((2e-3, 1e-3, 1e-3), "mm", "µm"),
])  # fmt: skip
def test_a_length_is_in_the_files_units(spacing, unit, text):
    values = np.arange(60.0).reshape(3, 4, 5)
    volume = Volume(values, spacing, file=FileFacts(spacing_unit=unit))
    start, end = (0.0, 0.0, 0.0), (1.0, 0.5, 0.0)
    length = np.linalg.norm(np.subtract(end, start) * volume.extent) * (1000 if unit else 1)
    assert Scale.of(volume).length_text(start, end) == f"{length:.4g} {text}"


def test_the_orthographic_view_stays_until_it_is_left(make_window):
    window = make_window()
    state, orthographic = window.state, action(window, "Orthographic")
    assert orthographic.shortcut().toString() == "O"
    home = state.view
    orthographic.trigger()
    assert state.view.is_orthographic and state.view.distance == home.distance
    assert window.status.view_text.endswith("orthographic")
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
