"""Windows on fake engines that have come to rest."""


def rested(qtbot, make_window):
    """Open a window that the ray caster alone draws, in direct light."""
    window = make_window(model=None, size="pane")
    work = window.workspace.reference
    work.choose(lighting="direct", drawing="raycast")
    qtbot.waitUntil(lambda: not work._pane_rest.isActive() and window.workspace.is_settled)
    return window
