"""HTML report of an evaluation: measures, profiles and a sheet of samples."""

from __future__ import annotations

import base64
import html
from typing import Any

import numpy as np
from imageio.v3 import imwrite
from numpy.typing import NDArray

from model.evaluation.error_profile import Group

PICTURES = 6
"""Number of samples of each kind on the sheet: worst, median and best."""

STYLE = """
body { font: 15px/1.45 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem;
  color: #222; background: #fff }
table { border-collapse: collapse; margin: .5rem 0 1.5rem }
th, td { padding: .2rem .8rem; text-align: right; border-bottom: 1px solid #ddd }
th:first-child, td:first-child { text-align: left }
.bar { display: inline-block; height: .7rem; background: #3b6ea5; vertical-align: middle }
img { width: 100%; image-rendering: pixelated; background: #000 }
"""

MEASURES = {
    "rmse": "image RMSE",
    "masked_rmse": "RMSE where opacity > .01",
    "emd": "colour EMD",
    "ssim": "SSIM",
    "flip": "FLIP",
    "st_lpips": "shift-tolerant LPIPS",
    "opacity_rmse": "opacity image RMSE",
}
AGREEMENTS = {
    "image_cosine": "whole image, cosine",
    "image_rank": "whole image, rank correlation",
    "block_cosine": "8 x 8 blocks, cosine",
    "block_rank": "8 x 8 blocks, rank correlation",
    "single_cosine": "whole image, single bins, cosine",
}
PROFILES = {
    "azimuth": "azimuth, degrees",
    "elevation": "elevation, degrees",
    "distance": "distance",
    "scalar": "scalar value (samples count by their opacity there)",
}


def extremes(errors: NDArray[np.float64], count: int = PICTURES) -> NDArray[np.intp]:
    """Return indices of the worst, the median and the best samples, worst first.

    There are `count` of each, without repetition; all samples if there are fewer.
    """
    order = np.argsort(-errors, kind="stable")
    if len(order) <= 3 * count:
        return order
    middle = (len(order) - count) // 2
    return np.concatenate([order[:count], order[middle : middle + count], order[-count:]])


def picture_sheet(truth: NDArray[np.floating], images: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Arrange true images, generated images and their differences in rows.

    Parameters
    ----------
    truth, images : ndarray, shape (N, S, S, 3)
        In [0, 1].

    Returns
    -------
    ndarray of uint8, shape (3 S R, S C, 3)
        R rows of C samples each, at most :data:`PICTURES`, side by side.
    """
    images = np.clip(images, 0, 1)
    rows = []
    for start in range(0, len(truth), PICTURES):
        part = slice(start, start + PICTURES)
        kinds = (truth[part], images[part], np.abs(images[part] - truth[part]))
        block = np.concatenate([np.concatenate(list(kind), axis=1) for kind in kinds])
        missing = PICTURES * truth.shape[2] - block.shape[1]
        rows.append(np.pad(block, ((0, 0), (0, missing if start else 0), (0, 0))))
    return np.rint(255 * np.concatenate(rows)).astype(np.uint8)


def html_report(
    title: str,
    result: dict[str, Any],
    profile: dict[str, list[Group]],
    sheet: NDArray[np.uint8],
) -> str:
    """Return the report as one HTML page with embedded images.

    Parameters
    ----------
    result : dict
        Result of :meth:`model.evaluation.holdout.Evaluation.to_json`, with
        "sensitivity_agreement" if that was measured.
    sheet : ndarray of uint8
        Result of :func:`picture_sheet`.
    """
    picture = base64.b64encode(imwrite("<bytes>", sheet, extension=".png")).decode()
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        f"<p>{result['count']} hold-out samples; the baseline is the nearest of "
        f"{result['nearest_neighbor']['count']} training images. Intervals hold the mean "
        "with 95 % confidence (bootstrap). SSIM is better when higher, all others when lower.</p>",
        _measures(result),
    ]
    if "sensitivity_agreement" in result:
        parts.append(_agreement(result["sensitivity_agreement"]))
    parts += ["<h2>Where the error is</h2>", *(_profile(n, profile[n]) for n in PROFILES)]
    parts.append(_scales(result["scales"]))
    parts += [
        "<h2>Samples</h2>",
        "<p>Worst, then median, then best by image RMSE; below each true image the generated "
        "one and the difference.</p>",
        f'<img alt="samples" src="data:image/png;base64,{picture}">',
    ]
    body = "\n".join(parts)
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{html.escape(title)}'
        f"</title><style>{STYLE}</style></head><body>\n{body}\n</body></html>\n"
    )


def _measures(result: dict[str, Any]) -> str:
    nearest = result["nearest_neighbor"]
    rows = []
    for key, name in MEASURES.items():
        if key not in result:
            continue
        ours, other = result[key], nearest.get(key)
        low, high = ours["interval"]
        cells = [
            f"{ours['mean']:.4f}",
            f"{low:.4f} to {high:.4f}",
            f"{ours['median']:.4f}",
            f"{ours['p95']:.4f}",
            f"{other['mean']:.4f}" if other else "",
        ]
        rows.append(_row(html.escape(name), *cells))
    head = "<tr><th></th><th>mean</th><th>interval</th><th>median</th><th>95 % are better than</th>"
    return f"<table>{head}<th>nearest, mean</th></tr>{''.join(rows)}</table>"


def _agreement(agreement: dict[str, Any]) -> str:
    rows = [
        _row(name, *(f"{agreement[key][q]:.2f}" for q in ("quartile1", "median", "quartile3")))
        for key, name in AGREEMENTS.items()
    ]
    return (
        "<h2>Sensitivity to the opacity TF</h2>"
        f"<p>Against the renderer's own, {agreement['count']} samples; 1 is perfect.</p>"
        "<table><tr><th></th><th>quartile 1</th><th>median</th><th>quartile 3</th></tr>"
        f"{''.join(rows)}</table>"
    )


def _profile(name: str, groups: list[Group]) -> str:
    largest = max(group.error for group in groups)
    rows = []
    for group in groups:
        share = group.error / largest if largest else 0.0
        rows.append(
            f"<tr><td>{group.low:.4g} to {group.high:.4g}</td><td>{group.count:.0f}</td>"
            f"<td>{group.error:.4f}</td>{_bar(share)}</tr>"
        )
    head = f"<tr><th>{html.escape(PROFILES[name])}</th><th>samples</th><th>RMSE</th><th></th></tr>"
    return f"<table>{head}{''.join(rows)}</table>"


def _scales(scales: list[dict[str, float]]) -> str:
    whole = sum(scale["error"] for scale in scales) or 1.0
    rows = []
    for scale in scales:
        part, left = scale["error"] / whole, scale["error"] / (scale["truth"] or 1.0)
        rows.append(
            f"<tr><td>{scale['pixels']:.0f}</td><td>{part:.0%}</td>"
            f"<td>{left:.1%}</td>{_bar(part)}</tr>"
        )
    head = "<tr><th>details of so many pixels</th><th>of the squared error</th>"
    return f"<table>{head}<th>error over details</th><th></th></tr>{''.join(rows)}</table>"


def _bar(share: float) -> str:
    """Return a table cell with a bar of a fraction, 0..1, of the longest bar's length."""
    bar = f'<span class="bar" style="width:{20 * share:.1f}rem"></span>'
    return f'<td style="text-align:left">{bar}</td>'


def _row(name: str, *cells: str) -> str:
    return f"<tr><td>{name}</td>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"
