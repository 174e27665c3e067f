"""The HTML report: its samples, its sheet, its figures."""

from __future__ import annotations

import base64
import io
import re
from dataclasses import asdict
from html.parser import HTMLParser

import numpy as np
from skimage.io import imread

from model.evaluation.error_profile import Group
from model.evaluation.error_scales import ErrorScale
from model.evaluation.report import MEASURES, PROFILES, extremes, html_report, picture_sheet


def test_the_sheet_shows_the_worst_the_median_and_the_best() -> None:
    errors = np.random.default_rng(0).permutation(101) / 100
    chosen = errors[extremes(errors, 3)]
    np.testing.assert_allclose(chosen, [1.0, 0.99, 0.98, 0.51, 0.5, 0.49, 0.02, 0.01, 0.0])
    assert sorted(extremes(errors[:7], 3)) == list(range(7))


def test_each_sample_stands_above_its_image_and_their_difference() -> None:
    rng = np.random.default_rng(1)
    truth, images = rng.random((8, 4, 4, 3)), 1.3 * rng.random((8, 4, 4, 3))
    sheet = picture_sheet(truth, images) / 255
    assert sheet.shape == (24, 24, 3)
    clipped = np.minimum(images, 1)
    for i, (row, column) in {0: (0, 0), 5: (0, 20), 7: (12, 4)}.items():
        for kind, expected in enumerate((truth[i], clipped[i], np.abs(clipped[i] - truth[i]))):
            part = sheet[row + 4 * kind : row + 4 * kind + 4, column : column + 4]
            np.testing.assert_allclose(part, expected, atol=0.51 / 255)


class Check(HTMLParser):
    """Notes tags that are not closed in their order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in ("img", "meta"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_the_page_is_whole_and_says_what_was_measured() -> None:
    summary = {"mean": 0.1234, "median": 0.1, "p95": 0.3, "interval": [0.11, 0.13]}
    agreement = {"quartile1": 0.11, "median": 0.22, "quartile3": 0.33}
    names = ("image_cosine", "image_rank", "block_cosine", "block_rank", "single_cosine")
    result = {
        "count": 9,
        **dict.fromkeys(MEASURES, summary),
        "scales": [asdict(ErrorScale(1, 0.03, 0.3)), asdict(ErrorScale(2, 0.01, 0.5))],
        "nearest_neighbor": {"count": 55, "rmse": {**summary, "mean": 0.4321}},
        "sensitivity_agreement": {"count": 3, **dict.fromkeys(names, agreement)},
    }
    profile = {name: [Group(0, 90, 5, 0.2), Group(90, 180, 4, 0.1)] for name in PROFILES}
    sheet = np.arange(48, dtype=np.uint8).reshape(4, 4, 3)
    page = html_report("a <volume>", result, profile, sheet)
    checker = Check()
    checker.feed(page)
    assert not checker.open
    for text in ("a &lt;volume&gt;", "0.1234", "0.4321", "0.1100 to 0.1300", "0.22", "90 to 180"):
        assert text in page
    assert "<td>1</td><td>75%</td><td>10.0%</td>" in page
    assert "<td>2</td><td>25%</td><td>2.0%</td>" in page
    match = re.search(r"base64,([^\"]+)", page)
    assert match is not None
    np.testing.assert_array_equal(imread(io.BytesIO(base64.b64decode(match[1]))), sheet)
