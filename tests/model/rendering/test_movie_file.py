import imageio.v3 as iio
import numpy as np
import pytest

from model.errors import RenderError
from model.rendering.movie_file import write_movie

# imageio leaves its reader's pipes to the garbage collection.
pytestmark = [
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_movies_can_be_read_again(tmp_path, suffix):
    levels = np.linspace(0.1, 0.9, 6)
    frames = (np.full((47, 65, 3), round(255 * level), np.uint8) for level in levels)
    path = write_movie(tmp_path / f"path{suffix}", frames, 25)
    read = np.asarray(iio.imread(path, index=None if suffix == ".gif" else ...))
    middle = read[:, 20, 20, 0].astype(np.float64) / 255
    # The sides of an MP4 are even.
    assert read.shape[:3] == ((6, 47, 65) if suffix == ".gif" else (6, 46, 64))
    assert middle == pytest.approx(levels, abs=0.06)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_movies_of_unknown_formats_are_refused(tmp_path):
    frames = [np.zeros((16, 16, 3), dtype=np.uint8)]
    with pytest.raises(RenderError, match="movies end in"):
        write_movie(tmp_path / "path.txt", frames, 25)
    with pytest.raises(RenderError, match="cannot be written"):
        write_movie(tmp_path / "missing" / "path.gif", frames, 25)


class EndedError(Exception):
    """What ends a movie."""


@pytest.mark.parametrize("suffix", [".mp4", ".gif"])
def test_a_movie_that_is_ended_leaves_nothing(tmp_path, suffix):
    def frames():
        yield np.zeros((16, 16, 3), np.uint8)
        raise EndedError

    with pytest.raises(EndedError):
        write_movie(tmp_path / f"path{suffix}", frames(), 25)
    assert not [*tmp_path.iterdir()]
