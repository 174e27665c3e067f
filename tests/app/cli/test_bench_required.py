"""What a picture does without costs it nothing: no module, no compiled function, no weights."""

from __future__ import annotations

from typing import Any

import pytest

from app.cli.bench.required import FEATURES, OTHERS, found_in, model_bytes, probed
from app.cli.bench.required_probe import USES
from model.volume_files.shipped import DEFAULT_VOLUME


@pytest.fixture(scope="module")
def plain() -> dict[str, Any]:
    return probed(DEFAULT_VOLUME)


@pytest.mark.slow
@pytest.mark.parametrize("feature", [*FEATURES, *OTHERS], ids=lambda each: each.name)
def test_a_plain_picture_has_nothing_of_a_feature(feature, plain: dict[str, Any]) -> None:
    assert found_in(feature, plain) == {"modules": [], "kernels": []}


@pytest.mark.slow
def test_inputs_that_change_nothing_compile_nothing(plain: dict[str, Any]) -> None:
    assert plain["added_by_neutral"] == []
    # What they take is the benchmark's to say: machines are busy.
    assert len(plain["ratios"]) == 5


@pytest.mark.slow
def test_a_features_marks_are_there_once_it_is_used() -> None:
    """Else nothing would be found of it, whatever it costs."""
    for feature in FEATURES:
        if feature.name in ("shadows", "missing voxels", "regions", "compact volumes"):
            found = found_in(feature, probed(DEFAULT_VOLUME, feature.name))
            assert found["modules"] or found["kernels"], feature.name
    assert set(USES) == {feature.name for feature in FEATURES}


def test_a_model_has_weights_only_for_inputs_that_vary() -> None:
    none, fixed, movable = model_bytes().values()
    assert none == fixed
    assert movable[0] == none[0] + 3 and movable[1] > none[1]


def test_marks_are_of_whole_names() -> None:
    (shadows,) = (feature for feature in FEATURES if feature.name == "shadows")
    kernels = [
        "model.rendering.raycast.shadows:sought",
        "model.rendering.raycast.shadow_derivatives:look",
        "model.rendering.raycast.batch:fetch",
    ]
    assert found_in(shadows, {"modules": [], "kernels": kernels})["kernels"] == kernels[:1]
