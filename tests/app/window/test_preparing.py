from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from PySide6.QtCore import QObject, Signal
from pytestqt.qtbot import QtBot
from window_fakes import PATIENCE_S, FakeBuilders

from app.engines.engines import ReferenceSettings
from app.engines.states import EngineState
from app.state import reference_work
from app.window.main_window import MainWindow
from model.kernel_cache import KernelGroup
from model.scene.volume import Volume


class HeldPreparation(QObject):
    """Prepares what the test says, when it says so."""

    prepared = Signal()
    progressed = Signal(int, int)

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self.there: set[KernelGroup] = set()
        self.wanted: Sequence[KernelGroup] = ()

    def want(self, groups: Sequence[KernelGroup]) -> None:
        self.wanted = groups
        self.progressed.emit(len(self.there & set(groups)), len(groups))

    def is_prepared(self, group: KernelGroup) -> bool:
        return group in self.there

    def finish(self, group: KernelGroup) -> None:
        self.there.add(group)
        self.want(self.wanted)
        self.prepared.emit()

    def begin(self) -> None:
        """Nothing waits."""

    def stop(self) -> None:
        """Nothing runs."""


def kernels(_volume: Volume, settings: ReferenceSettings) -> tuple[KernelGroup, ...]:
    light = settings.lighting
    return KernelGroup("uint8", light, "images"), KernelGroup("uint8", light, "questions")


def test_vtk_draws_until_the_kernels_are_compiled(
    qtbot: QtBot, builders: FakeBuilders, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reference_work, "Preparation", HeldPreparation)
    window = MainWindow(replace(builders.make(), kernels=kernels), None)
    qtbot.addWidget(window)
    work, analyst = window.workspace.reference, window.workspace._analyst
    work.choose(lighting="path")
    preparation = work.preparation
    assert isinstance(preparation, HeldPreparation)
    window.workspace.open_model(None)
    window.workspace.reading.open(Path("ramp"))
    window.show()
    client = window.reference.client
    qtbot.waitUntil(lambda: client.is_settled, timeout=1000 * PATIENCE_S)
    images, questions = preparation.wanted
    assert images.lighting == "path"
    assert (work.settings.lighting, work.settings.renderer) == ("direct", "vtk")
    assert analyst.state is EngineState.WAITING
    assert not window.workspace.is_settled
    assert "0 of 2" in window.status.preparation

    preparation.finish(images)
    assert work.settings.lighting == "path"
    assert analyst.state is EngineState.WAITING
    assert "1 of 2" in window.status.preparation
    qtbot.waitUntil(lambda: window.workspace.is_settled, timeout=1000 * PATIENCE_S)

    preparation.finish(questions)
    qtbot.waitUntil(lambda: analyst.is_ready, timeout=1000 * PATIENCE_S)
    assert window.status.preparation == ""

    answers = window.workspace.sensitivity.answers
    qtbot.waitUntil(lambda: bool(answers.regions), timeout=1000 * PATIENCE_S)
    preparation.there.clear()
    work.choose(lighting="soft")
    # They were of another light, or may be of another volume.
    assert not answers.regions
