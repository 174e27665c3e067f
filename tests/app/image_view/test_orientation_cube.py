import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest

from app.image_view.orientation_cube import SIZE, OrientationCube
from model.scene.orientation import STANDARD_VIEWS
from model.scene.view import axis_direction

EQUAL = (3**-0.5, 3**-0.5, 3**-0.5)


@pytest.fixture
def cube(state, canvas):
    cube = OrientationCube(state, canvas)
    cube.show()
    return cube


@pytest.mark.parametrize("name", STANDARD_VIEWS)
def test_a_standard_view_shows_its_face_in_the_middle(state, cube, name):
    state.look_from(name)
    assert list(cube.visible_faces) == [name]
    middle = cube.visible_faces[name]
    assert (middle.x(), middle.y()) == pytest.approx((SIZE / 2, SIZE / 2))


def test_a_click_on_a_face_looks_from_there(state, cube):
    state.start_view(EQUAL, "+y")
    assert set(cube.visible_faces) == {"Front", "Right", "Top"}
    QTest.mouseClick(cube, Qt.MouseButton.LeftButton, pos=cube.visible_faces["Right"].toPoint())
    _, up, back = state.view.basis()
    assert up == pytest.approx(axis_direction("+y"), abs=1e-9)
    assert back == pytest.approx(axis_direction("+x"), abs=1e-9)
    assert not state.live


def test_dragging_the_cube_turns_it_under_the_mouse(state, cube):
    state.look_from("Front")
    middle = QPoint(SIZE // 2, SIZE // 2)
    QTest.mousePress(cube, Qt.MouseButton.LeftButton, pos=middle)
    QTest.mouseMove(cube, middle + QPoint(12, 0))
    assert state.live
    assert cube.visible_faces["Front"].x() == pytest.approx(SIZE / 2 + 12, abs=4)
    QTest.mouseRelease(cube, Qt.MouseButton.LeftButton, pos=middle + QPoint(12, 0))
    assert not state.live


def test_labels_are_the_patients_where_they_are_known(state, cube):
    assert cube.labels["-x"] == "−X"
    state.start_view(EQUAL, "-y", tuple("PAISRL"))
    assert (cube.labels["+x"], cube.labels["-y"]) == ("P", "S")
    # From the patient's front, with the patient's left on the right.
    assert state.front_axis == "-x"
    QTest.mouseMove(cube, cube.visible_faces["Front"].toPoint())
    assert cube.toolTip().startswith("Front (the patient's front)")
    QTest.mouseMove(cube, cube.visible_faces["Right"].toPoint())
    assert cube.toolTip().startswith("Right (the patient's left)")
    # They can be set, and given back.
    for labels, shown in ((tuple("EWNSUD"), "E"), ((), "+X"), (None, "P")):
        cube.set_labels(labels)
        assert cube.labels["+x"] == shown
