"""The window that the tests of sensitivities begin with."""

import pytest


@pytest.fixture
def window(qtbot, make_window):
    """A window with a model, whose engines have both answered."""
    window = make_window()
    asker = window.workspace.sensitivity
    qtbot.waitUntil(lambda: set(asker.regions) == {"exact", "learned"})
    qtbot.waitUntil(lambda: asker.visibility is not None)
    return window
