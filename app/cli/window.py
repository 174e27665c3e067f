"""The default command: open the window."""

from __future__ import annotations

from pathlib import Path

from model.shipped import DEFAULT_VOLUME


def open_window(
    volume: Path | None, model: Path | None, device: str, screenshot: Path | None
) -> int:
    """Open the window and return its exit code."""
    from app.launch import run_window

    return run_window(volume or DEFAULT_VOLUME, model, device, screenshot)
