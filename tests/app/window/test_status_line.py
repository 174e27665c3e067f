import pytest

from app.state.sensitivity_state import SensitivityState
from app.window.status_line import StatusLine
from model.scene.view import View


@pytest.fixture
def line(qtbot, state):
    line = StatusLine(state, SensitivityState())
    qtbot.addWidget(line)
    line.resize(1200, 24)
    line.show()
    return line


def test_whole_sentences_are_shown_as_many_as_there_is_room_for(line):
    first, second = "This is short.", "This is so much longer that it does not fit. " * 4
    line.say(f"{first} {second}".strip())
    shown = line._news.text()
    assert shown.startswith(first) and shown.endswith(". …")
    line.say(f"{first} {second} {second} {second}".strip())
    assert line._news.text() == shown
    line.resize(140, 24)
    assert line._news.fontMetrics().horizontalAdvance(line._news.text()) <= line._news.width()
    line.say(first)
    line.resize(1200, 24)
    assert line._news.text() == first and line._news.toolTip() == ""


def test_a_sentence_goes_after_a_time_unless_it_is_about_what_is_under_way(qtbot, line):
    line._rest.setInterval(20)
    line.say("Reading a.nrrd …")
    assert line.news == "Reading a.nrrd …" and not line._rest.isActive()
    line.say("Saved a.png.")
    assert line.news == "Saved a.png."
    qtbot.waitUntil(lambda: line.news == "")


def test_news_go_when_what_they_are_about_is_undone(line, state):
    line.say("Opened a.json.")
    state.edits.undo()
    assert line.news == ""
    line.say("Reading a.nrrd …")
    state.edits.undo()
    assert line.news == "Reading a.nrrd …"


def test_the_views_numbers_are_about_the_up_axis(line, state):
    state.set_view(View(40.0, -10.0, 0.0, 0.75))
    assert line.view_text == "azimuth 40°   elevation −10°   distance .75"
    state.set_view(View(40.0, -10.0, 0.0, 0.75, 0.25, -0.001))
    assert line.view_text.endswith("pan +.25, +.00")
    state.set_view(View(40.0, -10.0))
    state.set_up_axis("-z")
    assert line.view_text == "azimuth 40°   elevation −10°   distance 1.00"
