import numpy as np
import pytest

from app.window.raw_dialog import UNKNOWN, RawDialog
from model.volume_files import read_volume
from model.volume_files.raw import RawLayout


@pytest.fixture
def open_dialog(qtbot, tmp_path):
    """Open the dialog on a smooth volume of 24 x 20 x 16 big-endian values."""
    dialogs = []
    z, y, x = np.meshgrid(*(np.linspace(-1, 1, n) for n in (16, 20, 24)), indexing="ij")
    bytes_ = (30000 * np.exp(-2 * (x * x + y * y + z * z))).astype(">u2").tobytes()

    def opened(name, content=bytes_):
        (tmp_path / name).write_bytes(content)
        dialog = RawDialog(tmp_path / name)
        dialogs.append(dialog)
        qtbot.addWidget(dialog)
        return dialog

    yield opened
    for dialog in dialogs:
        dialog.done(0)


def wait(qtbot, dialog):
    qtbot.waitUntil(lambda: not dialog._previews.is_running)


NAME = "data_24x20x16_ushort_big.raw"


def test_it_begins_with_what_the_name_says(qtbot, open_dialog):
    dialog = open_dialog(NAME)
    wait(qtbot, dialog)
    assert dialog.choice() == RawLayout((24, 20, 16), "uint16", "big")
    assert dialog.open_button.isEnabled()
    sizes = [(s.image.width(), s.image.height()) for s in dialog.slices if s.image]
    assert sizes == [(20, 16), (24, 16), (24, 20)]
    middle = [s.image.pixelColor(s.image.rect().center()).red() for s in dialog.slices if s.image]
    assert min(middle) > 250


def test_every_change_is_checked_and_previewed(qtbot, open_dialog):
    dialog = open_dialog(NAME)
    wait(qtbot, dialog)
    dialog.dimension_boxes[2].setValue(17)
    assert not dialog.open_button.isEnabled()
    assert "too few" in dialog.fit.text() and "16 voxels along z" in dialog.fit.text()
    wait(qtbot, dialog)
    first = dialog.slices[0].image
    assert first is not None and first.height() == 17
    dialog.dimension_boxes[2].setValue(16)
    assert dialog.open_button.isEnabled()
    wait(qtbot, dialog)
    right = dialog.slices[1].image
    dialog.order_box.setCurrentIndex(0)
    dialog.order_box.activated.emit(0)
    wait(qtbot, dialog)
    assert dialog.open_button.isEnabled()
    assert dialog.slices[1].image != right


def test_a_file_that_nothing_fits_and_one_that_is_gone(qtbot, open_dialog, tmp_path):
    dialog = open_dialog("prime.raw", b"x" * 1009)
    wait(qtbot, dialog)
    assert dialog.choice() == UNKNOWN and not dialog.open_button.isEnabled()
    assert "1,009 bytes" in dialog.fit.text()
    (tmp_path / "prime.raw").unlink()
    dialog.dimension_boxes[0].setValue(9)
    wait(qtbot, dialog)
    assert "prime.raw: the file cannot be read" in dialog.fit.text()
    assert not dialog.open_button.isEnabled()


def test_a_header_is_skipped(qtbot, open_dialog, tmp_path):
    content = np.arange(4 * 5 * 6, dtype=np.uint16).tobytes()
    dialog = open_dialog("scan_6x5x4_uint16.raw", b"head" * 8 + content)
    wait(qtbot, dialog)
    assert dialog.choice() == RawLayout((6, 5, 4), "uint16", offset=32)
    dialog.offset_box.setValue(0)
    assert "32 bytes too many. A header? It would fit with 32 bytes skipped" in dialog.fit.text()
    dialog.offset_box.setValue(32)
    assert dialog.open_button.isEnabled()
    volume = read_volume(tmp_path / "scan_6x5x4_uint16.raw", raw=dialog.choice())
    assert volume.data_range == (0, 119)
