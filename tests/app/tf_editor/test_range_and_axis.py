from dataclasses import replace

import numpy as np
import pyqtgraph as pg
import pytest
from editor_events import LEFT, double_click, drag, histogram
from hypothesis import example, given
from hypothesis import strategies as st
from mouse_events import pixel, wheel
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest

from app.tf_editor.histogram import HistogramLayer, without_comb
from app.tf_editor.unit_axis import OpacityScale, ScalarAxis, ticks
from app.theme import DARK, LIGHT, apply_theme
from model.scene.ranges import fit_to_range
from model.scene.tf_editing import recolor_stop
from model.scene.transfer_function import OpacityTF

MIDDLE = Qt.MouseButton.MiddleButton
CTRL = Qt.KeyboardModifier.ControlModifier


@pytest.fixture
def editor(open_editor):
    # One voxel far away, as of a piece of metal.
    counts, edges = np.array([100, 800, 99, 1]), np.array([100.0, 120.0, 180.0, 200.0, 300.0])
    return open_editor(histogram(counts, edges, (100.0, 300.0)))


def test_what_is_painted_from_a_cache_takes_another_theme(qapp, editor):
    grip = pixel(editor, 200.0, 1.0 + editor.area.headroom) + QPoint(3, 5)

    def ink():
        return editor.area.widget.grab().toImage().pixelColor(grip).name()

    try:
        apply_theme(qapp, "dark")
        assert ink() == DARK.dim
        apply_theme(qapp, "light")
        assert ink() == LIGHT.dim
    finally:
        apply_theme(qapp, "dark")


def test_with_ctrl_a_dragged_line_makes_what_it_passes_transparent(editor, state):
    before = state.transfer_function
    assert editor.area.axis.full == (100.0, 300.0)
    drag(editor, pixel(editor, 200.0, 0.9), pixel(editor, 140.0, 0.9), modifier=CTRL)
    cut, values = state.transfer_function, np.linspace(*before.scalar_range, 101)
    within, beyond = values[values < 139], values[values > 141]
    assert before.opacity(beyond).max() > 0.01
    assert cut.opacity([*beyond, 300.0]).max() == 0.0
    np.testing.assert_allclose(cut.opacity(within), before.opacity(within), atol=0.02)
    assert (cut.color, cut.scalar_range) == (before.color, before.scalar_range)
    assert state.edits.stack.undoText() == "cut"
    state.edits.undo()
    assert state.transfer_function == before
    assert not state.edits.stack.canUndo()


def test_what_a_line_passes_over_comes_back(editor, state):
    lo, hi = state.scalar_range
    opacity = OpacityTF((lo, hi), points=((lo, 0.0), (130.0, 0.3), (160.0, 0.1), (hi, 0.9)))
    before = replace(state.transfer_function, opacity=opacity)
    state.tf_input.set(before, "points")
    # Within one drag that cuts, and by the menu.
    viewport = editor.area.widget.viewport()
    QTest.mousePress(viewport, LEFT, CTRL, pixel(editor, 200.0, 0.5))
    for value in (110.0, 150.0):
        QTest.mouseMove(viewport, pixel(editor, value, 0.5))
    QTest.mouseRelease(viewport, LEFT, CTRL, pixel(editor, 150.0, 0.5))
    opacities = state.transfer_function.opacity([130.0, 145.0, 160.0])
    np.testing.assert_allclose(opacities, (0.3, 0.2, 0.0))
    state.edits.undo()
    editor.range.set_range((lo, 150.0))
    editor.range.set_range((lo, hi))
    assert state.transfer_function == before
    # What was edited meanwhile is not undone.
    editor.range.set_range((lo, 150.0))
    now = state.transfer_function
    edited = replace(now, color=recolor_stop(now.color, 0, (1.0, 0.0, 0.0)))
    state.tf_input.set(edited, "colour")
    editor.range.set_range((lo, hi))
    assert state.transfer_function == fit_to_range(edited, (lo, hi))


def test_the_menu_sets_the_range(qtbot, editor, state):
    editor.menu.fit_to_data()
    assert state.scalar_range == (100.0, 300.0)
    editor.menu.set_percentiles(20.0, 99.0)
    assert state.scalar_range == (120.0, 200.0)
    assert state.edits.stack.count() == 2
    # Return closes the typed range unless it is not taken.
    editor.menu.type_range()
    popup = editor.menu.popup
    qtbot.waitUntil(popup.low.hasFocus)
    QTest.keyClicks(popup.low, "9999")
    QTest.keyClick(popup.low, Qt.Key.Key_Return)
    assert popup.isVisible() and popup.low.text() == "9999"
    popup.low.selectAll()
    QTest.keyClicks(popup.low, "110")
    QTest.keyClick(popup.low, Qt.Key.Key_Return)
    qtbot.waitUntil(popup.isHidden)
    assert state.scalar_range[0] == 110.0


def test_ctrl_and_wheel_zoom_around_the_mouse_and_the_middle_button_pans(editor, state):
    before = state.transfer_function
    at = pixel(editor, 150.0, 0.7)
    wheel(editor.area.widget.viewport(), QPointF(at), 4, keys=CTRL)
    lo, hi = editor.area.axis.visible
    assert hi - lo == pytest.approx(200.0 / 1.25**4)
    assert pixel(editor, 150.0, 0.7).x() == pytest.approx(at.x(), abs=1)
    drag(editor, pixel(editor, 150.0, 0.7), pixel(editor, 140.0, 0.7), button=MIDDLE)
    assert editor.area.axis.visible == pytest.approx((lo + 10.0, hi + 10.0), abs=0.5)
    editor.area.widget.setFocus()
    QTest.keyClick(editor.area.widget, Qt.Key.Key_Home)
    assert editor.area.axis.visible == (100.0, 300.0)
    assert state.transfer_function == before


def test_a_small_opacity_is_set_by_a_drag_on_the_logarithmic_scale(editor, state):
    scale = OpacityScale(logarithmic=True)
    editor.area.set_scale(scale)
    start, end = (pixel(editor, v, scale.height(a)) for v, a in ((130.0, 0.5), (130.0, 0.01)))
    drag(editor, start, end)
    assert state.transfer_function.opacity.modes[0].amplitude == pytest.approx(0.01, rel=0.1)
    # A double click adds a mode where it is.
    at = pixel(editor, 250.0, scale.height(0.02))
    double_click(editor, at)
    assert state.transfer_function.opacity.modes[-1].amplitude == pytest.approx(0.02, rel=0.1)
    curve = editor.opacity._curve.heights
    assert curve.max() < scale.height(0.6)


def test_a_dragged_line_stretches_the_tf_and_back(editor, state):
    before = state.transfer_function
    viewport = editor.area.widget.viewport()
    start, end = pixel(editor, 200.0, 0.9), pixel(editor, 150.0, 0.9)
    under = editor.area.widget.items(pixel(editor, 100.0, 0.4))
    assert "With Ctrl" in next(item.toolTip() for item in under if item.toolTip())
    QTest.mousePress(viewport, LEFT, pos=start)
    QTest.mouseMove(viewport, (start + end) / 2)
    QTest.mouseMove(viewport, end)
    assert "Ctrl: cut" in editor.area.readout
    QTest.mouseRelease(viewport, LEFT, pos=end)
    lo, hi = state.scalar_range
    assert lo == 100.0
    assert hi == pytest.approx(150.0, abs=0.5)
    # The same curve and colours, closer together.
    stretched = state.transfer_function
    np.testing.assert_allclose(stretched.opacity.sample(), before.opacity.sample(), atol=1e-6)
    np.testing.assert_allclose(stretched.color.sample(), before.color.sample(), atol=1e-6)
    drag(editor, end, start)
    values = np.linspace(100.0, 200.0, 50)
    found = state.transfer_function.opacity(values)
    np.testing.assert_allclose(found, before.opacity(values), atol=0.05)


RANGES = [
    (0.0, 1.0), (-1000.0, 3095.0), (0.0, 255.0), (1e-15, 3e-15), (1e9, 1e9 + 1.0), (-7e12, 5e12),
    (0.0, 0.3),
]  # fmt: skip


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize("scalar_range", RANGES)
@given(share=st.floats(0, 1))
@example(share=2.36e-10)
def test_places_and_values_are_each_others_inverse(scalar_range, logarithmic, share):
    axis = ScalarAxis.over(scalar_range, logarithmic=logarithmic)
    value = axis.value(share)
    assert scalar_range[0] <= value <= scalar_range[1]
    assert axis.place(value) == pytest.approx(share, abs=1e-6)


@pytest.mark.parametrize("scalar_range", RANGES)
def test_ticks_say_the_value_at_their_place(scalar_range):
    lo, hi = scalar_range
    marks = ticks(scalar_range)
    assert 3 <= len(marks) <= 8
    assert len({text for _, text in marks}) == len(marks)
    for place, text in marks:
        assert -1e-6 <= place <= 1 + 1e-6
        assert float(text) == pytest.approx(lo + place * (hi - lo), abs=1e-3 * (hi - lo))


@pytest.mark.parametrize(("full", "numbers", "texts"), [
    ((-0.54, 5.5), {}, ["0", "1", "2", "3", "4", "5"]),
    ((-0.54, 2.5), {0: 0, 1: 17, 2: 2035}, ["0", "17", "2035"]),
    ((-1.2, 100.3), {}, ["−1", "0", "20", "40", "60", "80", "100"]),
])  # fmt: skip
def test_an_axis_of_labels_has_whole_numbers_and_ends_at_labels(full, numbers, texts):
    assert [text for _, text in ScalarAxis.over(full, numbers=numbers).marks()] == texts


@pytest.mark.parametrize("logarithmic", [False, True])
def test_opacities_come_back_from_their_heights(logarithmic):
    scale = OpacityScale(logarithmic)
    opacities = np.array([0.0, 1e-5, 0.001, 0.02, 0.5, 1.0])
    heights = scale.heights(opacities)
    assert (heights[0], heights[-1]) == (0.0, pytest.approx(1.0))
    assert (np.diff(heights) > 0).all()
    assert [scale.opacity(height) for height in heights] == pytest.approx(list(opacities))
    assert np.isfinite(scale.opacity(1e9)) and np.isfinite(scale.opacity(-1e9))


def test_on_a_logarithmic_scale_the_ends_say_what_they_are_logarithms_of():
    marks = ScalarAxis.over((-3.0, 2.0), labels="log").marks("K")
    assert marks[0] == (0.0, ".001") and marks[-1] == (1.0, "100 K")
    for place, text in marks[1:-1]:
        assert 10.0 ** (5.0 * place - 3.0) == pytest.approx(float(text), rel=1e-3)


SHAPE = 1000 * np.exp(-(((np.arange(256) - 120) / 50) ** 2)) + 20


@pytest.mark.parametrize("stretch", [2, 3, 7, 1.4])
def test_stretched_data_have_the_histogram_of_the_data_before(qapp, stretch):
    values = np.unique(np.floor(np.arange(0, 256, stretch)).astype(int))
    counts = np.zeros(256, dtype=np.int64)
    counts[values] = (SHAPE[values] * stretch).astype(np.int64)
    layer = HistogramLayer(pg.ViewBox())
    layer.set_data(counts, np.arange(257) - 0.5)
    drawn = without_comb(counts)
    assert layer.text_at(121.0, "linear") == f"about {drawn[121]:,.0f} voxels from 120.5 to 121.5"
    inner = slice(values[1], values[-2])
    assert (drawn[inner] > 0).all()
    if float(stretch).is_integer():
        assert drawn[inner] == pytest.approx(SHAPE[inner], rel=0.02)
    # Otherwise a tooth stands for as much as the one beside it, which has a wider gap.
    smooth, expected = (np.convolve(h[inner], np.ones(14), "valid") for h in (drawn, SHAPE))
    assert smooth == pytest.approx(expected, rel=0.05)
    assert drawn.sum() == pytest.approx(counts.sum(), rel=0.02)


def test_gaps_that_are_not_a_combs_stay():
    counts = SHAPE.astype(np.int64)
    counts[[*range(100, 140), 200]] = 0
    np.testing.assert_array_equal(without_comb(counts), counts)
    np.testing.assert_array_equal(without_comb(np.zeros(9, dtype=np.int64)), np.zeros(9))


def test_the_histogram_of_another_volume_is_painted(qapp, editor):
    gray = []
    for counts in ([800, 9, 9, 9], [9, 9, 9, 800]):
        editor.set_data(histogram(np.array(counts), np.linspace(100.0, 300.0, 5), (100.0, 300.0)))
        qapp.processEvents()
        shown = editor.area.widget.grab().toImage()
        gray.append([shown.pixelColor(pixel(editor, at, 0.7)).lightness() for at in (125.0, 275.0)])
    assert gray[0][0] > gray[1][0] and gray[0][1] < gray[1][1]
