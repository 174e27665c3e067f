import json
from dataclasses import replace

import pytest
from PySide6.QtCore import QSize
from PySide6.QtWidgets import QFileDialog
from ramp import make_tf, make_volume
from rested_window import act_until, open_volume, saved_figure

from app.state.preferences import volume_file
from app.state.session import FIGURE_TEXT
from app.window.figure import FigureChoice
from app.window.window_memory import first_size
from model.scene.crop import CropBox
from model.scene.region import Outline
from model.scene.view import View

VIEW = View(70.0, -25.0, 10.0, 1.2)


@pytest.fixture
def volume(tmp_path):
    """The file of the volume; what is read are the fake's."""
    (tmp_path / "ramp").touch()
    return tmp_path / "ramp"


def change_all(window, tf):
    window.state.tf_input.set(tf, "another")
    window.state.set_view(VIEW)
    window.state.crop_input.set(CropBox((0.1, 0.0, 0.2), (1.0, 0.9, 1.0)))
    window.workspace.reference.choose(lighting="soft", drawing="raycast", stop="fast")
    window.sensitivity_state.add_region(Outline.rectangle(0.2, 0.2, 0.5, 0.6))
    window.sensitivity_state.rename_region("the  ribs")
    window.sensitivity_state.choose(measure="change", width=9.0, panel=True)
    window.sensitivity_state.keep(120.0, 140.0)
    window.overlays.toggle("legend")
    window.overlays.toggle("cube")
    window.panes.shown, window.workspace.model.shows_image = "reference", True
    window.latent_state.choose(shown=True, on_map=True, band=(90.0, 120.5))
    window.brightness.set(1.5)
    window.brightness.finish()
    line = (0.1, 0.2, 0.3), (0.4, 0.5, 0.6)
    window.overlays.subject = replace(window.overlays.subject, line=line)


def open_session(qtbot, window, path):
    act_until(qtbot, window.workspace.volumeStarted, window.files.open, path)


def texts_of(window):
    return [text for text in window.notice.text.splitlines() if text]


def test_all_comes_back(qtbot, start_again, builders, volume, tmp_path):
    window, path = start_again(volume), tmp_path / "a.tfscope"
    other = make_tf(115.0)
    change_all(window, other)
    saved = window.sessions.session()
    window.sessions.save(path)
    assert "a.tfscope" in window.windowTitle()
    figure = tmp_path / "paper" / "figure.png"
    figure.parent.mkdir()
    texts = saved_figure(qtbot, window, FigureChoice(90, 40), figure)
    assert texts.text("Volume") == "ramp" and texts.text("Software").startswith("tfscope")
    held = texts.text(FIGURE_TEXT)
    assert str(tmp_path) not in held and json.loads(held)["volume"]["path"] == "ramp"
    bare = saved_figure(qtbot, window, FigureChoice(90, 40, session=False), tmp_path / "b.png")
    assert {*texts.textKeys()} - {*bare.textKeys()} == {"Volume", FIGURE_TEXT}
    # Another look, of the same window.
    window.state.tf_input.set(make_tf(), "back")
    window.state.set_view(View(0.0, 0.0, 0.0, 1.0))
    window.state.crop_input.set(None)
    window.workspace.reference.choose(lighting="none", drawing="auto", stop="balanced")
    window.sensitivity_state.remove_region()
    window.sensitivity_state.release()
    window.sensitivity_state.choose(measure="signed", width=6.0, panel=False)
    window.overlays.toggle("legend")
    window.panes.shown, window.workspace.model.shows_image = "both", None
    window.latent_state.choose(shown=False, on_map=False, band=None)
    window.ruler.remove()
    between = window.sessions.session()
    open_session(qtbot, window, path)
    assert window.sessions.session() == saved
    assert window.state.transfer_function == other and window.state.view == VIEW
    assert window.overlays.has("legend") and not window.overlays.has("cube")
    assert window.browser.bar.band.text() == "90 to 120.5"
    assert "a.tfscope" in window.windowTitle()
    # What was there before is a click away.
    (notice,) = [text for text in texts_of(window) if "as you had left it" in text]
    assert "a.tfscope is open" in notice
    open_session(qtbot, window, tmp_path / "kept" / "before_session.tfscope")
    found = window.sessions.session()
    memory, before = found.content.memory, between.content.memory
    assert (memory.tf, memory.view) == (before.tf, before.view)
    assert memory.regions == before.regions == ()
    # And in the next run, over another volume.
    window.close()
    builders.volumes["other"] = make_volume("other", 300.0)
    window = start_again(volume)
    window.crop_card.set_shown(True)
    open_volume(qtbot, window, "other")
    assert "a.tfscope" not in window.windowTitle() and not window.crop_card.is_shown
    open_session(qtbot, window, path)
    assert window.sessions.session() == saved
    assert window.preferences.recent("sessions") == [path]
    # A figure opens like a session; its volume is found in another folder.
    window.state.set_view(View(0.0, 0.0, 0.0, 1.0))
    open_session(qtbot, window, figure)
    assert window.sessions.session() == saved
    # A and B in one image, where B has the light of A.
    window.state.tf_input.compare(True)
    window.panes.show_b(True, True)
    window.wipe.put(0.3)
    window.top_bar.difference.click()
    saved = window.sessions.session()
    content = saved.content
    assert (content.wipe, content.memory.pane, content.difference) == (0.3, "B", True)
    window.sessions.save(path)
    window.wipe.put(0.6)
    window.top_bar.difference.click()
    window.panes.show_b(True, False)
    window.state.tf_input.compare(False)
    window.workspace.reference.choose(lighting="none")
    open_session(qtbot, window, path)
    assert window.sessions.session() == saved and window.top_bar.difference.isChecked()


def test_differences_are_reported(qtbot, start_again, builders, volume, tmp_path, monkeypatch):
    # A light that is not there.
    window, path = start_again(volume), tmp_path / "a.tfscope"
    window.workspace.reference.choose(lighting="direct")
    window.sessions.save(path)
    path.write_text(path.read_text().replace('"lighting": "direct"', '"lighting": "shadows"'))
    open_session(qtbot, window, path)
    assert window.workspace.reference.settings.lighting == "soft"
    (notice,) = texts_of(window)
    assert "'lighting' could not be read" in notice
    window.notice.clear()
    # Other voxels, and a file that is damaged.
    window.sessions.save(path)
    builders.volumes["ramp"] = make_volume(top=201.0)
    open_session(qtbot, window, path)
    assert any("voxels of ramp differ" in text for text in texts_of(window))
    window.notice.clear()
    before = window.sessions.session()
    path.write_text('{"tfscope_session": 1, "volume": []}')
    window.files.open(path)
    assert window.sessions.session() == before
    (notice,) = texts_of(window)
    assert "a.tfscope" in notice and "nothing was changed" in notice
    window.notice.clear()
    # A volume that is nowhere is asked for.
    change_all(window, make_tf(115.0))
    window.sessions.save(path)
    saved, opened = window.sessions.session(), window.workspace.opened
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    volume.rename(elsewhere / "ramp")
    window.files.open(path)
    assert window.workspace.opened is opened
    (notice,) = texts_of(window)
    assert "ramp" in notice and "neither" in notice
    place = str(elsewhere / "ramp"), ""
    monkeypatch.setattr(QFileDialog, "getOpenFileName", lambda *_: place)
    act_until(qtbot, window.workspace.volumeStarted, window.sessions._locate, path, "ramp")
    found = window.sessions.session()
    assert found is not None and saved is not None
    assert found.volume == elsewhere / "ramp"
    assert found.content == saved.content


# Logical pixels, the title bar aside: 1366 x 768 at 125 %, 1920 x 1080 at 200 %, large ones.
@pytest.mark.parametrize(
    ("free", "size"),
    [((1093, 590), (1000, 558)), ((960, 510), (960, 478)), ((3840, 2100), (1440, 900))],
)
def test_it_opens_at_four_fifths_of_the_screen_within_limits(free, size):
    assert first_size(QSize(*free)) == QSize(*size)


def test_tf_regions_and_the_plots_scales(qtbot, start_again, builders, tmp_path):
    builders.volumes["other"] = make_volume("other", 300.0)
    kept = tmp_path / "kept"
    damaged = kept / "volumes" / f"{builders.volumes['ramp'].fingerprint[:32]}.json"
    damaged.parent.mkdir(parents=True)
    damaged.write_text("{}")
    window = start_again()
    # Damaged files are reported, and replaced.
    assert f"{damaged}: the file is damaged" in window.notice.text
    default = window.state.transfer_function
    window.state.tf_input.set(make_tf(142.0), "edit")
    asked = window.sensitivity_state
    for left in (0.1, 0.3, 0.5):
        asked.add_region(Outline.rectangle(left, 0.2, left + 0.1, 0.4))
    asked.activate(1)
    asked.rename_region("ribs")
    asked.change_region(asked.outline.moved(0.05, 0.0))
    asked.finish("regions")
    asked.activate(2)
    asked.remove_region()
    asked.activate(1)
    wanted = asked.regions
    assert [one.name for one in wanted] == ["Region 1", "ribs"]
    open_volume(qtbot, window, "other")
    assert volume_file(kept, builders.volumes["other"].fingerprint).values.tf is None
    assert window.state.scalar_range == (100.0, 300.0)
    assert asked.regions == () and asked.active is None
    open_volume(qtbot, window, "ramp")
    assert window.state.transfer_function == make_tf(142.0)
    assert asked.regions == wanted and asked.region_name == "ribs"
    editor = window.editor
    editor.menu.set_logarithmic(True)
    (fine,) = (a for a in editor.menu.menu.findChildren(type(editor.menu._fine))
               if a.text() == "Logarithmic opacity")  # fmt: skip
    fine.trigger()
    editor.area.zoom(3.0, 0.5)
    axis, scale = editor.area.axis, editor.area.scale
    open_volume(qtbot, window, "other")
    assert editor.area.axis.scale == "linear" and not editor.area.scale.logarithmic
    open_volume(qtbot, window, "ramp")
    assert editor.area.axis == axis and editor.area.scale == scale
    window.close()
    again = start_again()
    assert again.state.transfer_function == make_tf(142.0)
    again.state.reset_transfer_function()
    assert again.state.transfer_function == default
    assert again.sensitivity_state.regions == wanted
    assert again.sensitivity_state.region_name == "ribs"
    assert again.editor.area.axis == axis and again.editor.area.scale == scale
