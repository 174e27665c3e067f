"""What a model's card says about its worth: errors in all and by kind of opacity TF."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from model.errors import CheckpointError
from model.networks.card import load_card

KIND_NAMES = {
    "modes": "mixtures of modes",
    "ramp": "ramps",
    "plateau": "plateaus",
    "step": "steps",
    "band": "bands",
    "curve": "free curves",
    "constant": "constants",
    "nearly empty": "nearly empty",
    "empty": "empty",
}
"""Names of the kinds of opacity TFs (:data:`model.scene.random_tfs.OpacityKind`) for display."""


def errors_by_kind(metrics: dict[str, Any]) -> dict[str, float]:
    """Mean RMSE of a model's colour images (0..1) for each kind of opacity TF, largest first.

    Parameters
    ----------
    metrics : dict
        Of the model's card; "kinds" as :mod:`model.evaluation.job` gives them.

    Returns
    -------
    dict of float
        By the names of :data:`KIND_NAMES`; empty where the card has none.
    """
    kinds = metrics.get("kinds")
    found = {}
    for kind, name in KIND_NAMES.items():
        entry = kinds.get(kind) if isinstance(kinds, dict) else None
        error: Any = entry.get("rmse") if isinstance(entry, dict) else None
        if _is_number(error):
            found[name] = float(error)
    return dict(sorted(found.items(), key=lambda item: -item[1]))


def error_text(metrics: dict[str, Any]) -> str:
    """Describe a model's recorded errors in a sentence; empty where its card has none."""
    holdout = metrics.get("holdout")
    count = metrics.get("holdout_count")
    parts = []
    if isinstance(holdout, dict) and _is_number(holdout.get("rmse")):
        of = f" of {count:,} hold-out images" if isinstance(count, int) else ""
        emd = f", colour EMD {holdout['emd']:.3f}" if _is_number(holdout.get("emd")) else ""
        parts.append(f"RMSE{of} {holdout['rmse']:.3f}{emd}")
    kinds = errors_by_kind(metrics)
    if kinds:
        listed = ", ".join(f"{name} {error:.3f}" for name, error in kinds.items())
        parts.append(f"by kind of TF: {listed}" if parts else f"RMSE by kind of TF: {listed}")
    return f"{'; '.join(parts)}." if parts else ""


def worth_of(folder: Path) -> str:
    """Describe the recorded errors of a model's folder; empty where it cannot be read."""
    try:
        return error_text(load_card(folder).metrics)
    except CheckpointError:
        return ""


def _is_number(value: object) -> bool:
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and math.isfinite(value)  # type: ignore[arg-type]
