"""Saving a compact volume: compressed to a size or an error, measured, and written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from model.errors import VolumeError, reason
from model.evaluation.compact_error import IMAGES, TrueImages, encode_within, restored
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.scene.volume import Volume
from model.volume_files.compact import ImageError, write_compact
from model.volume_files.voxel_code import encode_voxels


@dataclass(frozen=True)
class CompactOrder:
    """What to save.

    Attributes
    ----------
    megabytes : float or None
        Size of the file; exactly one of this and `error` is given.
    error : float or None
        Largest mean RMSE of images.
    tf, view
        To show the volume through and from at first; None leaves them to who opens it.
    up : str
        Axis that points up; empty for what the volume says.
    images : int
        Random views and TFs that the error is measured over.

    Raises
    ------
    VolumeError
        When neither or both of size and error are given, or one is not positive.
    """

    out: Path
    megabytes: float | None = None
    error: float | None = None
    tf: TransferFunction | None = None
    view: View | None = None
    up: str = ""
    images: int = IMAGES

    def __post_init__(self) -> None:
        if (self.megabytes is None) == (self.error is None):
            raise VolumeError(
                "A compact volume needs a size in megabytes or an image error; give one of them.",
                error="0.004",
            )
        if self.megabytes is not None and not 0 < self.megabytes < float("inf"):
            raise VolumeError(f"A size of {self.megabytes:g} MB is none; give one such as 1.5.")


@dataclass(frozen=True)
class CompactResult:
    """What was saved.

    Attributes
    ----------
    nbytes : int
        Of the file.
    share : float
        Of the volume's voxels, uncompressed.
    error : ImageError or None
        None where nothing was lost.
    """

    nbytes: int
    share: float
    error: ImageError | None

    @property
    def sentence(self) -> str:
        """Size and error in words."""
        size = f"{self.nbytes / 1e6:.3g} MB, {100 * self.share:.2g} % of the volume"
        if self.error is None:
            return f"{size}; nothing was lost."
        return (
            f"{size}; image error {self.error.rmse:.2g}, largest {self.error.largest:.2g}, over "
            f"{self.error.images} random views and TFs."
        )


def save_compact(
    volume: Volume,
    order: CompactOrder,
    on_progress: Callable[[str, float], None] = lambda what, done: None,
) -> CompactResult:
    """Compress a volume, measure how far its images are from the truth, and write it.

    Parameters
    ----------
    volume : Volume
        As it was read.
    on_progress : callable
        Called with what is being done and the fraction of it that is done; what it raises ends
        the work, and nothing is written.

    Raises
    ------
    VolumeError
        When the size is too small, the error is none, or the file cannot be written.
    """
    volume = volume.linear
    truth = TrueImages(volume)
    if order.error is not None:
        coded = encode_within(
            volume, order.error, truth, lambda done: on_progress("looking for the size", done)
        )
    else:
        assert order.megabytes is not None
        coded = encode_voxels(volume.voxels, int(1e6 * order.megabytes), volume.missing)
    error = None
    if not coded.is_exact:
        error = truth.error_of(
            restored(volume, coded),
            order.images,
            lambda done: on_progress("measuring the error", done),
        )
    try:
        write_compact(order.out, volume, coded, error, order.tf, order.view, order.up)
        size = order.out.stat().st_size
    except OSError as failure:
        raise VolumeError(
            f"{order.out}: the compact volume cannot be written ({reason(failure)}); choose "
            "another place."
        ) from failure
    return CompactResult(size, size / volume.voxels.nbytes, error)
