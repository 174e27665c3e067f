import numpy as np
import pytest

from app.tf_editor.editor import TransferFunctionEditor
from app.tf_editor.plot_area import PlotData

DATA = PlotData(np.arange(256), np.linspace(100.0, 200.0, 257), (100.0, 200.0), "K")


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
