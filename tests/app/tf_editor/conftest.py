import numpy as np
import pytest
from editor_events import histogram

from app.tf_editor.editor import TransferFunctionEditor

DATA = histogram(np.arange(256), np.linspace(100.0, 200.0, 257), (100.0, 200.0))


@pytest.fixture
def open_editor(qtbot, state):
    def opened(data=DATA, width=1100, height=300):
        editor = TransferFunctionEditor(state)
        qtbot.addWidget(editor)
        editor.set_data(data)
        editor.resize(width, height)
        editor.show()
        qtbot.waitExposed(editor)
        state.start_volume(state.transfer_function, None)
        return editor

    return opened


@pytest.fixture
def editor(open_editor):
    return open_editor()
