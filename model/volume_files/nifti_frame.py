"""Where a NIfTI grid lies: its three ways to say so, compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.scene.volume import Triple

ALIKE = 1e-3
"""Relative difference of voxel sizes below which they count as equal."""


@dataclass(frozen=True, eq=False)
class NiftiFrame:
    """Spacing, origin and directions of a grid.

    Attributes
    ----------
    origin : tuple of float
        In the patient's space (RAS).
    directions : ndarray of float64, shape (3, 3), or None
        Row k is the step from one voxel to the next along axis k; None if unknown.
    notes : tuple of str
        What disagrees.
    """

    spacing: Triple | None
    origin: Triple = (0.0, 0.0, 0.0)
    directions: NDArray[np.float64] | None = None
    notes: tuple[str, ...] = ()


def nifti_frame(header: Any) -> NiftiFrame:
    """Return the frame by a header's sform, else its qform, else its voxel sizes alone.

    Parameters
    ----------
    header : nibabel.Nifti1Header
        Or one of NIfTI-2.
    """
    sizes = tuple(float(size) for size in header["pixdim"][1:4])
    sform = _affine(header, "sform")
    qform = _affine(header, "qform")
    best = sform if sform is not None else qform
    notes: tuple[str, ...] = ()
    if int(header["sform_code"]) > 0 and sform is None:
        notes += ("The file's sform is unusable; its qform or voxel sizes are used instead.",)
    if best is None:
        spacing = None if not any(sizes) else sizes
        return NiftiFrame(spacing, notes=notes)  # type: ignore[arg-type]
    directions = best[:3, :3].T
    lengths = np.linalg.norm(directions, axis=1)
    if sform is not None:
        if not np.allclose(lengths, np.abs(sizes), rtol=ALIKE):
            notes += (
                f"The file's voxel sizes {_times(sizes)} differ from those of its sform, "
                f"{_times(lengths)}; the sform holds.",
            )
        if qform is not None:
            notes += _differences(sform, qform)
    x, y, z = (float(length) for length in lengths)
    origin = best[:3, 3]
    return NiftiFrame((x, y, z), (float(origin[0]), float(origin[1]), float(origin[2])),
                      directions, notes)  # fmt: skip


def _affine(header: Any, name: str) -> NDArray[np.float64] | None:
    """Return one of the header's matrices, shape (4, 4); None if it is not set or unusable."""
    try:
        found = getattr(header, f"get_{name}")(coded=True)[0]
    except Exception:
        # Quaternions that are no rotation.
        return None
    if found is None:
        return None
    matrix = np.array(found, np.float64)
    if not np.isfinite(matrix).all() or abs(np.linalg.det(matrix[:3, :3])) < 1e-30:
        return None
    return matrix


def _differences(sform: NDArray[np.float64], qform: NDArray[np.float64]) -> tuple[str, ...]:
    """Say in what the two matrices disagree."""
    s, q = sform[:3, :3], qform[:3, :3]
    if np.linalg.det(s) * np.linalg.det(q) < 0:
        what = "are mirror images of one another"
    else:
        s_unit, q_unit = s / np.linalg.norm(s, axis=0), q / np.linalg.norm(q, axis=0)
        size = float(np.abs(s).max())
        if not np.allclose(s_unit, q_unit, atol=1e-2):
            what = "turn the grid differently"
        elif not np.allclose(sform[:3, 3], qform[:3, 3], atol=size):
            what = "place the grid differently"
        else:
            return ()
    return (f"The file's sform and qform {what}; the sform holds.",)


def _times(sizes: Any) -> str:
    return " x ".join(f"{float(size):.4g}" for size in sizes)
