from hypothesis import given
from hypothesis import strategies as st

from model.sensitivity.contributions import Contribution, percentages


def listed(*shares):
    return [Contribution(0.0, share, (0.0, 0.0)) for share in shares]


@given(st.lists(st.floats(0.001, 1.0), min_size=1, max_size=3))
def test_shares_never_add_up_to_more_than_all_and_are_off_by_one_at_most(parts):
    shares = [part / max(sum(parts), 1.0) for part in parts]
    whole = percentages(listed(*shares))
    assert sum(whole) <= 100
    assert all(
        abs(percent - 100 * share) <= 1 for percent, share in zip(whole, shares, strict=True)
    )


def test_the_one_that_was_rounded_up_most_gives_way():
    assert percentages(listed(0.436, 0.287, 0.277)) == (43, 29, 28)
    assert percentages(listed(0.75, 0.25)) == (75, 25)
    assert percentages(()) == ()
