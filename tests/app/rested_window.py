"""Windows on fake engines that have come to rest, and steps in them."""

from pathlib import Path

from PySide6.QtGui import QImage
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QPushButton


def rested(qtbot, make_window):
    """Open a window that the ray caster alone draws, in direct light."""
    # From the start: the kernels of no other light are compiled.
    window = make_window(model=None, size=None, lighting="direct", drawing="raycast")
    follow_pane(qtbot, window)
    return window


def follow_pane(qtbot, window):
    """Wait for images of the panes' new sizes."""
    rest, work = window.workspace.reference._pane_rest, window.workspace
    qtbot.waitUntil(lambda: not rest.isActive() and work.is_settled)


def act_until(qtbot, signal, act, *values, **named):
    """Do something, and wait for the signal that it brings about."""
    with qtbot.waitSignal(signal):
        act(*values, **named)


def settle(qtbot, window):
    qtbot.waitUntil(lambda: window.workspace.is_settled)


def open_volume(qtbot, window, name):
    """Open a volume of the fakes, and wait until its TF is set."""
    act_until(qtbot, window.workspace.volumeStarted, window.workspace.opening.open, Path(name))


def saved_figure(qtbot, window, choice, place):
    """Save a figure, and return it as it is in its file."""
    window.saving.draw(choice, place)
    qtbot.waitUntil(place.exists)
    return QImage(str(place))


def press(qtbot, window, key):
    window.activateWindow()  # keys go to the active one
    qtbot.waitUntil(window.isActiveWindow)
    QTest.keyClick(window, key)


def notice_buttons(window):
    found = window.notice.findChildren(QPushButton)
    return {button.text(): button for button in found if not button.isHidden()}
