from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.typed_numbers import read_number, without_unit


@pytest.mark.parametrize(
    ("typed", "meant"),
    [
        ("100 000", 100_000),
        ("100\u202f000", 100_000),
        ("1'234'567", 1_234_567),
        ("1.234,5", 1234.5),
        ("1,234.5", 1234.5),
        ("1.234.567", 1_234_567),
        ("1,234,567.25", 1_234_567.25),
        ("12 345,75", 12_345.75),
        ("0,25", 0.25),
        ("0,250", 0.25),
        ("1.234", 1.234),
        ("12,5", 12.5),
        ("\u221212.5", -12.5),
        (" 2.5e-9 ", 2.5e-9),
        (".5", 0.5),
        ("-1 024", -1024),
    ],
)
def test_numbers_are_read_as_they_are_meant(typed: str, meant: float) -> None:
    assert read_number(typed) == meant


@pytest.mark.parametrize(
    ("typed", "meant"), [("1,900", 1900), ("1.900", 1900), ("2 048", 2048), ("1e3", 1000)]
)
def test_whole_numbers_have_no_decimals(typed: str, meant: int) -> None:
    assert read_number(typed, whole=True) == meant


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("", "Type a number"),
        ("e-", "is not a number"),
        ("1 2", "between thousands"),
        ("1 000'000", "between thousands"),
        ("1,23,456", "has a comma where"),
        ("1.23,5", "has a point where"),
        ("1,900", "may be 1900 or 1.9"),
        ("--1", "is not a number"),
        ("1e999", "too large"),
        ("nan", "is not a number"),
    ],
)
def test_what_is_no_number_or_two_says_so(typed: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_number(typed)


def test_a_fraction_is_no_whole_number() -> None:
    with pytest.raises(ValueError, match="not a whole number"):
        read_number("12.5", whole=True)


@pytest.mark.parametrize("typed", ["2000 px", "2000px", "2000 PX ", "2000", "2000 px px"])
def test_a_unit_behind_a_number_is_taken_off(typed: str) -> None:
    assert without_unit(typed, " px") == "2000"


@given(st.integers(-(10**12), 10**12), st.sampled_from(list(" '_\u2009")))
def test_what_python_sets_apart_is_read_back(number: int, gap: str) -> None:
    assert read_number(f"{number:,}".replace(",", gap)) == number


@given(st.text(alphabet="0123456789.,' eE+-", max_size=12))
def test_any_text_is_read_or_refused_in_words(text: str) -> None:
    try:
        said = repr(read_number(text))
    except ValueError as error:
        said = str(error)
    assert "could not convert" not in said and said[0] in "“T0123456789-"
