"""The transfer function (TF) under which a volume is seen first."""

from __future__ import annotations

from model.scene.default_tf import AIR_HU, TISSUE_HU, body_range, default_transfer_function
from model.scene.ranges import fit_to_range, stretch_to_range
from model.scene.tf_presets import looks_like_hu
from model.scene.transfer_function import Range, TransferFunction
from model.scene.volume import Volume
from model.volume_files.shipped import SCAN_HU, designed_tf, scan_tf

LEAST_OPACITY = 0.5
"""Opacity that a designed TF must reach at a volume's values; else there is nothing to see."""

LOWEST_HU = -4096.0
"""Below it, values are none in HU, not even those outside a scanner's field of view."""


def first_transfer_function(volume: Volume) -> TransferFunction:
    """Return the designed TF of a shipped volume or a CT scan, else one off the histogram.

    CT scans are shown as the shipped one is: those in Hounsfield units (HU), by their unit or
    their values, and those on another scale whose peaks tell which one.
    """
    designed = designed_tf(volume)
    if designed is None:
        values = _scan_values(volume)
        designed = None if values is None else stretch_to_range(scan_tf(), values)
    if designed is not None and designed.scale == volume.scale:
        fitted = fit_to_range(designed, volume.scalar_range)
        if fitted.opacity.sample().max() >= LEAST_OPACITY:
            return fitted
    return default_transfer_function(volume)


def _scan_values(volume: Volume) -> Range | None:
    """Values that have the shipped scan's lowest and greatest HU, or None for no CT scan."""
    units = volume.units.strip().upper()
    if units == "HU":
        return SCAN_HU
    if units or volume.scale != "linear":
        return None
    if volume.data_range[0] >= LOWEST_HU and looks_like_hu(volume.data_range):
        return SCAN_HU if volume.distribution.is_whole else None
    body = body_range(volume)
    if body is None:
        return None
    slope = (body[1] - body[0]) / (TISSUE_HU - AIR_HU)
    low, high = (body[0] + slope * (hu - AIR_HU) for hu in SCAN_HU)
    return low, high
