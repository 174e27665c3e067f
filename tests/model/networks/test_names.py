"""Names that one chooses among are those of what there is."""

from typing import get_args

import pytest

from model.evaluation.study import STUDIES
from model.networks.names import PresetName, StudyName
from model.training.options import PRESETS


@pytest.mark.parametrize(("names", "table"), [(PresetName, PRESETS), (StudyName, STUDIES)])
def test_names_are_those_of_the_table(names, table):
    assert get_args(names) == tuple(table)
