"""The command of a training that the window starts, or measures the pace of."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path
from typing import TypedDict, Unpack

from model.scene.scene import Lighting
from model.scene.transfer_function import Range
from model.scene.value_scale import ValueScale, values_at
from model.volume_files.choice import LARGEST, Choice

TFSCOPE = (sys.executable, str(Path(__file__).resolve().parents[2] / "main.py"))


class TrainingChoices(TypedDict, total=False):
    """What a model is of, and how it is trained.

    Attributes
    ----------
    preset : str
        See :data:`model.training.options.PRESETS`; if left out, "compact".
    lighting : {"none", "direct", "soft", "shadows", "path"}
        The model can follow the light's direction.
    scalar_range : tuple of float, or None
        Range that the TFs lie over, on the scale; None for the volume's.
    scale : {"linear", "log"}
    raw_layout : str
        Layout of a headerless file, see :meth:`RawLayout.parse`; empty for none.
    up : str
        The volume's axis that points up; empty for what the file says.
    choice : Choice
        What to read of a file that holds several volumes.
    """

    preset: str
    lighting: Lighting
    scalar_range: Range | None
    scale: ValueScale
    raw_layout: str
    up: str
    choice: Choice


def training_order(
    volume_path: Path, minutes: float, **choices: Unpack[TrainingChoices]
) -> tuple[str, ...]:
    """Return the arguments of ``tfscope`` for a training, but for its folder."""
    lighting = choices.get("lighting", "none")
    scale = choices.get("scale", "linear")
    scalar_range = choices.get("scalar_range")
    order = ["train", "--volume", str(volume_path.absolute())]
    order += ["--preset", choices.get("preset", "compact"), "--minutes", f"{minutes:g}"]
    order += ["--lighting", lighting, "--json-lines"]
    if lighting != "none":
        order.append("--movable-light")
    if scalar_range is not None:
        lo, hi = values_at(scalar_range, scale)
        # One word, as it may begin with a minus.
        order.append(f"--range={float(lo)!r},{float(hi)!r}")
    if scale != "linear":
        order += ["--scale", scale]
    if raw := choices.get("raw_layout"):
        order += ["--raw", raw]
    # One word each, as a name may begin with a minus.
    named = asdict(choices.get("choice", LARGEST))
    order += [f"--{kind}={name}" for kind, name in named.items() if name is not None]
    if up := choices.get("up"):
        order.append(f"--up={up}")
    return tuple(order)
