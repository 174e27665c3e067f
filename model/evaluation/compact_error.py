"""A volume as it comes back from its code."""

from __future__ import annotations

from dataclasses import replace

from model.scene.volume import Volume
from model.volume_files.voxel_code import CodedVoxels, Ends, decode_voxels


def restored(volume: Volume, coded: CodedVoxels) -> Volume:
    """Return a volume as it comes back from its code."""
    voxels = volume.voxels
    shape = voxels.shape[0], voxels.shape[1], voxels.shape[2]
    ends = Ends.of(voxels, volume.missing)
    return replace(volume, voxels=decode_voxels(coded, shape, voxels.dtype, ends))
