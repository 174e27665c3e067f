from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from fake_models import make_model
from ramp import make_tf, make_volume
from rested_window import act_until, notice_buttons

from app.window import files
from app.window.volume_dialogs import PropertiesDialog
from model.scene.scene import Scene
from model.scene.transfer_function import ColorTF, OpacityTF, TransferFunction
from model.volume_files import read_volume
from model.volume_files.raw import RawLayout


def over(tf, lo, hi):
    return TransferFunction(
        OpacityTF((lo, hi), tf.opacity.modes),
        ColorTF((lo, hi), ((lo, 0.0, 0.0, 0.0), (hi, 1.0, 1.0, 1.0))),
    )


def test_a_tf_is_shown_over_its_range_or_fitted(qtbot, window, tmp_path, builders):
    unit = over(make_tf(0.25), 0.0, 1.0)
    unit.save(tmp_path / "tf.json")
    window.files.open_transfer_function(tmp_path / "tf.json")
    assert window.state.scalar_range == (100.0, 200.0)
    assert window.state.transfer_function.opacity.modes[0].mean == 125.0
    assert "fitted" in window.status.news
    narrow = over(make_tf(150.0), 120.0, 180.0)
    narrow.save(tmp_path / "tf.json")
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.files.open_transfer_function(tmp_path / "tf.json")
    assert window.state.transfer_function == narrow
    opened = window.workspace.opened
    assert opened is not None and opened.volume.scalar_range == (120.0, 180.0)
    assert opened.volume.data_range == (100.0, 200.0)
    act_until(qtbot, window.workspace.rangeChanged, window.state.edits.undo)
    assert window.workspace.opened.volume.scalar_range == (100.0, 200.0)
    visible = window.editor.area.axis.visible
    with qtbot.waitSignal(window.workspace.rangeChanged):
        window.state.tf_input.set(over(make_tf(), 120.0, 180.0), "edit")
    histogram = window.editor.area.histogram
    assert histogram.counts.sum() == 120
    inside = histogram.edges[(histogram.edges > 120) & (histogram.edges < 180)]
    assert np.ptp(np.diff(inside)) < 1e-9
    assert window.editor.area.axis.visible == visible
    act_until(qtbot, window.workspace.rangeChanged, window.state.edits.undo)
    # Otherwise all handles lie over one another.
    over(make_tf(151.0), 150.0, 152.0).save(tmp_path / "tf.json")
    axis = window.editor.area.axis
    assert axis.visible == (100.0, 200.0)
    window.files.open_transfer_function(tmp_path / "tf.json")
    places = window.editor.area.axis.places((150.0, 152.0))
    assert 0.0 < places[0] < 0.25 and 0.75 < places[1] < 1.0
    with qtbot.waitSignal(window.workspace.problem):
        window.state.tf_input.set(over(make_tf(), 900.0, 950.0), "edit")
    assert "900" in window.notice.text
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    builders.volumes["other"] = make_volume("other", 300.0)
    for name, expected in (("other", (100.0, 300.0)), ("ramp", (100.0, 200.0))):
        act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, Path(name))
        assert window.state.scalar_range == expected


def test_a_model_offers_its_volume_and_comes_back_with_it(qtbot, window, builders, tmp_path):
    other = make_volume("other", 300.0)
    builders.volumes["other"], builders.scene = other, Scene.of(other, image_size=16)
    place = tmp_path / "other.nrrd"
    place.touch()
    folder = make_model(tmp_path / "model", "other", 300.0)
    window.files.open_model(folder)
    assert "'other'" in window.notice.text
    with qtbot.waitSignal(window.workspace.volumeStarted):
        notice_buttons(window)["Open other.nrrd"].click()
    assert window.workspace.model.folder == folder
    assert window.notice.text == ""
    qtbot.waitUntil(lambda: window.preferences.recent("models") == [folder])
    known = window.preferences.volume(other.fingerprint)
    assert (known.path, known.models) == (str(place), (str(folder),))
    # Beside a model, a TF keeps to its range.
    over(make_tf(150.0), 120.0, 180.0).save(tmp_path / "tf.json")
    window.files.open_transfer_function(tmp_path / "tf.json")
    assert window.state.scalar_range == (100.0, 300.0)
    assert window.state.transfer_function.opacity.modes[0].mean == 150.0
    window.files.open_model(tmp_path)
    assert str(tmp_path) in window.notice.text
    assert window.workspace.model.folder == folder
    act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, Path("ramp"))
    assert window.workspace.model.folder is None
    act_until(qtbot, window.workspace.volumeStarted, window.files.open_volume, place)
    assert window.workspace.model.folder == folder


def test_files_are_opened_as_what_they_are_asked_for_once_and_named_where_they_are_gone(
    qtbot, window, tmp_path, monkeypatch
):
    make_tf(123.0).save(tmp_path / "tf.json")
    window.files.open(tmp_path / "tf.json")
    assert window.state.transfer_function == make_tf(123.0)
    for kind in ("volumes", "models", "transfer_functions"):
        window.files.open_recent(kind, tmp_path / f"{kind}.gone")
        assert f"{kind}.gone" in window.notice.text
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    layout = RawLayout((4, 5, 6), "uint8", spacing=(1.0, 1.0, 2.5))
    asked = []

    class Dialog:
        def __init__(self, path, parent):
            asked.append(path)

        def exec(self):
            return True

        def choice(self):
            return layout

        def deleteLater(self):  # noqa: N802 (Qt's name)
            pass

    monkeypatch.setattr(files, "RawDialog", Dialog)
    used = []

    def read(path, raw=None):
        used.append(raw)
        return replace(make_volume(path.stem), spacing=(1.0, 1.0, 2.5))

    monkeypatch.setattr(window.workspace.opening, "_read_volume", read)
    scan = tmp_path / "scan.raw"
    scan.write_bytes(bytes(120))
    for _ in range(2):
        act_until(qtbot, window.workspace.volumeStarted, window.files.open, scan)
    assert asked == [scan]
    assert used == [layout, layout]


def test_spacing_and_stretch_are_typed_and_kept_with_the_file(qtbot, make_window, tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, np.arange(120.0).reshape(4, 5, 6))
    window = make_window(model=None)
    opened = partial(qtbot.waitSignal, window.workspace.volumeStarted)
    window.workspace.opening._read_volume = read_volume
    with opened():
        window.files.open(path)
    tf = over(make_tf(40.0), 0.0, 119.0)
    window.state.tf_input.set(tf, "edit")
    window.files.show_properties()
    dialog = window.findChild(PropertiesDialog)
    for text, is_good in (("1, 1", False), ("0.5, 0.5, 0", False), ("0.5, 0.5, 2 um", True)):
        dialog.spacing.setText(text)
        dialog.spacing.textEdited.emit(text)
        assert dialog.apply.isEnabled() == is_good
        assert (dialog.problem.text() == "") == is_good
    with opened():
        dialog.apply.click()
    volume = window.workspace.opened.volume
    assert (volume.spacing, volume.file.spacing_unit) == ((0.5, 0.5, 2.0), "um")
    assert "was typed" in volume.notes[-1]
    assert window.state.transfer_function == tf
    with opened():
        window.files.open(path)
    assert window.workspace.opened.volume.spacing == (0.5, 0.5, 2.0)
    window.files.show_properties()
    dialog = window.findChildren(PropertiesDialog)[-1]
    dialog.stretch.setText("3")
    dialog.stretch.textEdited.emit("3")
    with opened():
        dialog.apply.click()
    for _ in range(2):
        opened_volume = window.workspace.opened.volume
        assert (opened_volume.spacing, opened_volume.file.stretch) == ((0.5, 0.5, 6.0), 3.0)
        with opened():
            window.files.open(path)
