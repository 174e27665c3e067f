import numpy as np
import pytest

from model.errors import TfscopeError
from model.scene.range_choice import RangeChoice
from model.scene.volume import Volume


def test_values_and_percentiles_are_read():
    assert RangeChoice.parse("-100,1500.5") == RangeChoice(-100, 1500.5)
    assert RangeChoice.parse("1%, 99.5%") == RangeChoice(1, 99.5, are_percentiles=True)


@pytest.mark.parametrize(
    "text", ["", "1", "1,2,3", "a,b", "5,1", "nan,1", "1%,2", "-1%,50%", "1%,101%", "0,inf"]
)
def test_what_is_no_range_is_refused(text):
    with pytest.raises(TfscopeError, match=r"range|percentiles"):
        RangeChoice.parse(text)


def test_percentiles_are_those_of_the_voxels():
    voxels = np.arange(1000, dtype=np.int16).reshape(10, 10, 10)
    volume = Volume(voxels)
    assert RangeChoice.parse("10,20").of(volume) == (10, 20)
    expected = np.percentile(voxels, [5, 90], method="inverted_cdf")
    assert RangeChoice.parse("5%,90%").of(volume) == pytest.approx(expected, abs=1)
