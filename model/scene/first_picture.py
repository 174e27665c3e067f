"""What a volume is first shown through: its file's own TF, or one from its histogram."""

from __future__ import annotations

from model.scene.default_tf import default_transfer_function
from model.scene.range_fitting import fit_to_volume
from model.scene.transfer_function import TransferFunction
from model.scene.volume import Volume


def first_picture(volume: Volume) -> tuple[Volume, TransferFunction]:
    """Return a volume over the range of its first TF, and that TF.

    Parameters
    ----------
    volume : Volume
        Over the range that it is shown over where its file has no TF.
    """
    if volume.file.tf is None:
        return volume, default_transfer_function(volume)
    tf = fit_to_volume(volume.file.tf, volume)
    return volume.over(tf.scalar_range, tf.scale), tf
