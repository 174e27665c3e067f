from __future__ import annotations

from app.state.fidelity import Fidelity


def test_the_error_of_a_compact_volume_is_said_of_each_image() -> None:
    exact, moving = Fidelity(), Fidelity(0.03, True)
    assert exact.of_copy(None) == exact and exact.of_copy(0.001) == exact
    found = exact.of_copy(0.004)
    assert found.text == "error ~.004, as good as it gets here"
    assert "compact copy" in found.reasons[0] and ".004" in found.reasons[0]
    assert moving.of_copy(0.04).text == "error ~.05"
    assert Fidelity(0.03, False, "refining").of_copy(0.04).text == "error ~.05, refining"
    # What is not known does not become known.
    assert Fidelity(None, False, "refining").of_copy(0.04).text == "refining"
