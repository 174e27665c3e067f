"""The default command, which opens the window."""

from __future__ import annotations

from pathlib import Path

from model.generator.catalog import volume_for
from model.volume_files.shipped import DEFAULT_VOLUME


def open_window(
    volume: Path | None,
    model: Path | None,
    device: str,
    backend: str,
    precision: str,
    screenshot: Path | None,
) -> int:
    """Open the window and return its exit code.

    By default, the volume is the model's if it is shipped, and otherwise the default one.
    """
    from app.engines.engines import GeneratorSettings
    from app.launch import run_window

    generators = GeneratorSettings(device, backend, precision)
    if volume is None and model is not None:
        volume = volume_for(model)
    return run_window(volume or DEFAULT_VOLUME, model, generators, screenshot)
