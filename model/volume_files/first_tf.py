"""The transfer function (TF) under which a volume is seen first."""

from __future__ import annotations

from model.scene.default_tf import default_transfer_function
from model.scene.range_fitting import fit_to_range, stretch_to_range
from model.scene.transfer_function import TransferFunction
from model.scene.volume import Volume
from model.volume_files.shipped import SCAN_HU, designed_tf, scan_tf

LEAST_OPACITY = 0.5
"""Opacity that a designed TF must reach at a volume's values; else there is nothing to see."""


def first_transfer_function(volume: Volume) -> TransferFunction:
    """Return the designed TF of a shipped volume or a CT scan, else one off the histogram.

    Scans in Hounsfield units are shown as the shipped scan is.

    Returns
    -------
    TransferFunction
        Defined over the volume's scalar range.
    """
    designed = designed_tf(volume)
    if designed is None and volume.units.strip().upper() == "HU":
        designed = stretch_to_range(scan_tf(), SCAN_HU)
    if designed is not None and designed.scale == volume.scale:
        fitted = fit_to_range(designed, volume.scalar_range)
        if fitted.opacity.sample().max() >= LEAST_OPACITY:
            return fitted
    return default_transfer_function(volume)
