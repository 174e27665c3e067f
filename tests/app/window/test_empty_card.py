from pathlib import Path

from ramp import make_volume

from app.image_view.orientation_cube import OrientationCube
from model.volume_files.shipped import shipped_volumes


def test_a_window_without_a_volume_offers_some(qtbot, make_window, builders):
    window = make_window(volume="lost", model=None)
    card, canvas = window.empty_card, window.reference.canvas
    assert "missing" in canvas.message
    assert card.isVisible() and canvas.rect().contains(card.geometry())
    assert len(card.samples) == len(shipped_volumes())
    # What would do nothing says so.
    assert not window.tools.isEnabled() and not window.editor.isEnabled()
    assert not any(cube.isVisible() for cube in window.findChildren(OrientationCube))
    assert window.status.keys == "[Ctrl O] open a volume"
    name = shipped_volumes()[0].stem
    builders.volumes[name] = make_volume(name)
    card.samples[0].click()
    qtbot.waitUntil(lambda: window.workspace.is_settled)
    assert window.windowTitle().startswith(name)
    assert card.isHidden() and window.tools.isEnabled()
    assert window.status.keys.startswith("[Drag] turn")
    assert any(cube.isVisible() for cube in window.findChildren(OrientationCube))
    # One that is there stays when another one cannot be read.
    window.files.open_volume(Path("lost"))
    qtbot.waitUntil(lambda: "missing" in window.notice.text)
    assert card.isHidden()
