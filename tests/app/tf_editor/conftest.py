import numpy as np
import pytest

from app.tf_editor.editor import TransferFunctionEditor
from app.tf_editor.plot_area import PlotData

DATA = PlotData(np.arange(256), np.linspace(100.0, 200.0, 257), (100.0, 200.0), "K")


@pytest.fixture
def editor(qtbot, state):
    """An editor over 100..200 K, 1100 x 300 pixels large."""
    editor = TransferFunctionEditor(state)
    qtbot.addWidget(editor)
    editor.set_data(DATA)
    editor.resize(1100, 300)
    editor.show()
    qtbot.waitExposed(editor)
    state.start_volume(state.transfer_function, None)
    return editor
