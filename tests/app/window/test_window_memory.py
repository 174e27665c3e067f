import pytest
from PySide6.QtCore import QSize
from ramp import make_tf, make_volume
from rested_window import open_volume

from app.state.preferences import volume_file
from app.window.window_memory import first_size
from model.scene.region import Outline


@pytest.mark.parametrize(
    ("free", "size"),
    [
        # Logical pixels, the title bar aside: 1366 x 768 at 125 %, 1920 x 1080 at 150
        # and 200 %, 1280 x 720, large ones.
        ((1093, 590), (1000, 558)),
        ((1280, 690), (1024, 640)),
        ((960, 510), (960, 478)),
        ((1280, 680), (1024, 640)),
        ((1920, 1040), (1440, 832)),
        ((3840, 2100), (1440, 900)),
        ((1280, 1000), (1024, 800)),
    ],
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
    # What is damaged is told, and begins anew.
    assert f"{damaged}: the file is damaged" in window.notice.text
    default = window.state.transfer_function
    window.state.tf_input.set(make_tf(142.0), "edit")
    asked = window.sensitivity_state
    for left in (0.1, 0.3, 0.5):
        asked.add_region(Outline.rectangle(left, 0.2, left + 0.1, 0.4))
    asked.activate(1)
    asked.rename_region("ribs")
    asked.change_region(asked.outline.moved(0.05, 0.0))
    asked.finish_region()
    asked.activate(2)
    asked.remove_region()
    asked.activate(1)
    wanted = asked.regions
    assert [one.name for one in wanted] == ["Region 1", "ribs"]
    open_volume(qtbot, window, "other")
    assert volume_file(kept, builders.volumes["other"].fingerprint).values.tf is None
    assert window.state.scalar_range == (100.0, 300.0)
    assert asked.regions == () and asked.active is None
    # Numbers are of the volume.
    asked.add_region(Outline.rectangle(0.6, 0.6, 0.7, 0.7))
    assert asked.region_name == "Region 1"
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
    assert scale.logarithmic and axis.scale == "log" and axis.visible != axis.full
    open_volume(qtbot, window, "other")
    assert editor.area.axis.scale == "linear" and not editor.area.scale.logarithmic
    assert not fine.isChecked() and not editor.menu._logarithmic.isChecked()
    open_volume(qtbot, window, "ramp")
    assert editor.area.axis == axis and editor.area.scale == scale
    assert fine.isChecked() and editor.menu._logarithmic.isChecked()
    window.close()
    again = start_again()
    assert again.state.transfer_function == make_tf(142.0)
    again.state.reset_transfer_function()
    assert again.state.transfer_function == default
    assert again.sensitivity_state.regions == wanted
    assert again.sensitivity_state.region_name == "ribs"
    assert again.editor.area.axis == axis and again.editor.area.scale == scale
    again.sensitivity_state.add_region(Outline.rectangle(0.6, 0.6, 0.7, 0.7))
    assert again.sensitivity_state.region_name == "Region 4"
    open_volume(qtbot, again, "other")
    assert [one.name for one in again.sensitivity_state.regions] == ["Region 1"]
