"""Bands of values as they are typed."""

from __future__ import annotations

import pytest

from app.latent_browser.latent_browser import parsed_band


@pytest.mark.parametrize(
    ("text", "band"),
    [
        ("", None),
        ("90 to 120", (90.0, 120.0)),
        ("-5, 3.5", (-5.0, 3.5)),
        ("90-120", (90.0, 120.0)),
        ("-5--3", (-5.0, -3.0)),
        ("120 – 90", (90.0, 120.0)),
        ("1e3", (1000.0, 1000.0)),
    ],
)
def test_bands_are_read(text, band):
    assert parsed_band(text) == band
