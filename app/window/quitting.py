"""The question before a window is closed that would take unfinished work with it."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import QMessageBox, QWidget


def may_quit(parent: QWidget, unfinished: Sequence[str]) -> bool:
    """Ask whether to close all the same; without anything unfinished, do not ask.

    Parameters
    ----------
    unfinished : sequence of str
        What is under way, each as "turn.mp4 is being written"; empty ones do not count.
    """
    under_way = [each for each in unfinished if each]
    if not under_way:
        return True
    text = "\n".join(f"{each}." for each in under_way)
    stop = "Quit and stop it?" if len(under_way) == 1 else "Quit and stop them?"
    answer = QMessageBox.question(parent, "Quit", f"{text}\n{stop}")
    return answer == QMessageBox.StandardButton.Yes
