import pytest
from PySide6.QtCore import QRectF

from app.number_box import MINUS
from app.tf_editor.plot_area import HEADROOM, LEFT_MARGIN, RIGHT_MARGIN, PlotArea, PlotLabels
from app.tf_editor.unit_axis import ScalarAxis


@pytest.mark.parametrize(("height", "axis"), [(281, 225), (190, 134), (218, 162)])
def test_the_plot_gets_the_room(qtbot, height, axis):
    area = PlotArea()
    qtbot.addWidget(area.widget)
    area.widget.resize(1440, height)
    area.widget.show()
    qtbot.waitExposed(area.widget)
    assert area.opacity.height() == pytest.approx(axis, abs=2)
    assert area.opacity.sceneBoundingRect().left() == pytest.approx(LEFT_MARGIN, abs=1)
    right = 1440 - area.opacity.sceneBoundingRect().right()
    assert right == pytest.approx(RIGHT_MARGIN, abs=3)
    # Opacity 1 leaves the headroom free; the second plot's ground is the same.
    top = area.pixel(area.opacity, 0.0, 1.0).y()
    assert top - area.rect.top() == pytest.approx(HEADROOM, abs=1)
    assert area.pixel(area.back, 0.0, 0.5).y() == area.pixel(area.opacity, 0.0, 0.5).y()


@pytest.mark.parametrize(
    ("full", "first", "last"),
    [
        ((0.0, 255.0), "0", "255 HU"), ((-1024.0, 2985.7), "−1024", "2985.7 HU"),
        ((0.0, 0.2999999), "0", "0.3 HU"), ((1e9, 1e9 + 1.0), "1000000000", "1000000001 HU"),
        ((1.5e-9, 3e-9), "1.5e−09", "3e−09 HU"), ((0.0, 65535.0), "0", "65535 HU"),
    ],
)  # fmt: skip
def test_both_ends_are_labelled_and_the_unit_is_said_once(full, first, last):
    labels = ScalarAxis.over(full).marks("HU")
    assert (labels[0], labels[-1]) == ((0.0, first), (1.0, last))
    axis = ScalarAxis.over(full)
    for place, text in labels[1:-1]:
        assert "HU" not in text
        assert axis.value(place) == pytest.approx(
            float(text.replace(MINUS, "-")), abs=1e-3 * (full[1] - full[0])
        )


def test_on_a_logarithmic_scale_the_ends_say_what_they_are_logarithms_of():
    marks = ScalarAxis.over((-3.0, 2.0), labels="log").marks("K")
    assert marks[0] == (0.0, "0.001") and marks[-1] == (1.0, "100 K")
    for place, text in marks[1:-1]:
        assert 10.0 ** (-3.0 + 5.0 * place) == pytest.approx(
            float(text.replace(MINUS, "-")), rel=1e-3
        )


def test_no_two_numbers_overlap_and_those_at_the_ends_are_there(qtbot):
    labels = PlotLabels("bottom")
    for width in (200, 644, 2204):
        labels.resize(width, 20)
        labels.set_labels(ScalarAxis.over((0.0, 254.0)).marks("a.u."), "#ffffff")
        boxes = labels.boxes()
        texts = [text for _, text in boxes]
        assert "0" in texts and "254 a.u." in texts
        for index, (box, _) in enumerate(boxes):
            assert not any(QRectF(box).intersects(other) for other, _ in boxes[index + 1 :])
        assert boxes[1][0].right() <= width + RIGHT_MARGIN
