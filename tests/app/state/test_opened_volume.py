from pathlib import Path

import numpy as np

from app.state.opened_volume import OpenedVolume
from model.scene.ranges import robust_range
from model.scene.volume import Volume

PLACE = Path("volume.nrrd")


def test_an_outlier_does_not_widen_what_is_looked_at_first():
    voxels = np.linspace(2, 7, 8000).reshape(20, 20, 20)
    voxels[3, 3, 3] = 1e9
    volume = Volume(voxels)
    opened = OpenedVolume.of(PLACE, volume.over(robust_range(volume)))
    assert opened.volume.scalar_range == opened.default.scalar_range == (2.0, 7.0)
    assert 2 <= opened.window[0] < opened.window[1] <= 7
    # The outlier is counted, too, and does not make the other bins coarser.
    assert (opened.edges[0], opened.edges[-1]) == (2.0, 1e9)
    assert opened.counts.sum() == voxels.size and opened.counts[-1] == 1
    assert np.diff(opened.edges).min() < 5 / 250


def test_another_range_changes_what_follows_from_it_alone():
    volume = Volume(np.arange(8000, dtype=np.int16).reshape(20, 20, 20))
    opened = OpenedVolume.of(PLACE, volume)
    assert opened.volume.scalar_range == (0, 7999)
    other = opened.over((100.0, 355.0))
    assert other.volume.scalar_range == other.default.scalar_range == (100, 355)
    assert 100 <= other.window[0] < other.window[1] <= 355
    assert (other.fingerprint, other.path) == (opened.fingerprint, PLACE)
    assert other.counts.sum() == volume.voxels.size
    assert set(other.counts[(other.edges[:-1] > 100) & (other.edges[1:] < 355)]) == {1}
