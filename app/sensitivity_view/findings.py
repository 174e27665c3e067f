"""Findings of the panel, as data: values of a region or place, strongest edits, sources."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from app import theme
from app.glosses import gloss
from app.number_box import short
from app.state.sensitivity_asker import RegionAnswer, SensitivityAsker, VisibilityAnswer, displayed
from app.state.workspace import Workspace
from model.networks.card import recorded_agreement
from model.scene.region import ImageRegion
from model.scene.transfer_function import TF_SAMPLES
from model.sensitivity.display import FLOOR, SMALL_EDIT
from model.sensitivity.peaks import (
    Contribution,
    Interval,
    contributions,
    follow,
    percentages,
    strongest_intervals,
)

GOOD, FAIR = 0.9, 0.7  # least cosines of good and fair agreement
ROWS = 3  # most values, and most edits
MOST = 0.5  # largest change that is predicted in numbers: pixels saturate, the prediction does not
LEAST_SHOWN = 0.001  # least change of pixel values that is shown: a quarter of an 8-bit step

VALUE_TIP = "{} make up {} % of what is visible. Point at them in the plot to see where."
EDIT_TIP = (
    "A mode of this opacity at {} to {} changes the region's pixels (0 to 1) by about this much,\n"
    "and by less where the image saturates. What if renders the edit."
)


@dataclass(frozen=True)
class Row:
    """A line of the panel: texts, and below them a bar whose length is a share."""

    texts: tuple[str, ...]
    tip: str
    badge: str = ""
    share: float | None = None


@dataclass(frozen=True)
class Values:
    """The values of a region or place, in a fixed order while they are edited."""

    place: ImageRegion | None = None
    found: tuple[Contribution, ...] = ()

    def of(self, asker: SensitivityAsker, holds: bool) -> Values:
        """Return the present values in the order of these, if they are held."""
        answer = answer_of_values(asker)
        if answer is None:
            return Values()
        scalar_range, place = asker.state.scalar_range, answer.request.regions[0]
        before = self.found if holds and place == self.place else ()
        found = contributions(answer.value[0], scalar_range)
        listed = follow(before, found, scalar_range, partial(replace, share=0.0))
        # What is below a held list stays in place, too.
        return Values(place, listed[: len(before) or ROWS])


def answer_of_values(asker: SensitivityAsker) -> VisibilityAnswer | None:
    """Return the answer with the panel's values; None until it is there."""
    asked, answer = asker.asked, asker.visibility
    if asked.place is not None:
        return asker.pick
    return answer if answer is not None and answer.request.regions[0] == asked.outline else None


def displayed_now(
    asker: SensitivityAsker, answer: RegionAnswer | None
) -> NDArray[np.float64] | None:
    """Responses (256,) in the displayed unit; None without any of the present measure."""
    if answer is None or answer.request.measure != asker.asked.choices.measure:
        return None
    return displayed(answer)


def of_interest(asker: SensitivityAsker) -> NDArray[np.bool_]:
    """Whether each of 256 values is of interest or above: below is the background."""
    return np.asarray(np.linspace(*asker.state.scalar_range, TF_SAMPLES) >= asker.window[0])


@dataclass(frozen=True)
class Peaks:
    """The highest peaks of the region's curve, the highest first."""

    intervals: tuple[Interval, ...] = ()
    strongest: float | None = None  # value of the strongest edit; None if no edit shows
    question: tuple[object, ...] = ()  # region, measure and range of the curve

    def of(self, asker: SensitivityAsker, holds: bool) -> Peaks:
        """Find them in the preferred answer, in the order of these if they are held."""
        answer = asker.region
        values = displayed_now(asker, answer)
        if answer is None or values is None or not asker.asked.choices.shown:
            return Peaks()
        scalar_range, low = answer.request.inputs.opacity_tf.scalar_range, asker.window[0]
        window = low, asker.state.scalar_range[1]
        height = asker.asked.choices.height
        found = strongest_intervals(values, scalar_range, ROWS, window=window)
        found = tuple(one for one in found if abs(one.predicted(height)) >= LEAST_SHOWN)
        question = answer.request.region, answer.request.measure, scalar_range
        if holds and question == self.question:
            gone = partial(replace, response=0.0)
            found = follow(self.intervals, found, scalar_range, gone)[:ROWS]
        strongest = None
        if np.abs(values).max() >= FLOOR * SMALL_EDIT:
            inside = np.where(of_interest(asker), np.abs(values), 0.0)
            strongest = float(np.linspace(*scalar_range, TF_SAMPLES)[int(inside.argmax())])
        return Peaks(found, strongest, question)


@dataclass(frozen=True)
class Findings:
    """Rows of one part of the panel, and a note; stale ones belong to another image."""

    rows: tuple[Row, ...]
    note: str
    is_fresh: bool


def values_found(asker: SensitivityAsker, values: tuple[Contribution, ...]) -> Findings:
    """List what is visible in the active region, or at the clicked place if there is one."""
    answer = answer_of_values(asker)
    is_fresh = answer is not None and answer.is_of(asker.state.inputs)
    waiting = asker.waiting if asker.engines else ""
    rows = []
    for one, percent in zip(values, percentages(values), strict=True):
        reach = asker.state.range_text(one.reach)
        tip = VALUE_TIP.format(reach, percent)
        rows.append(Row((reach, f"{percent} %"), tip, share=one.share))
    note = "" if values else "nothing visible" if is_fresh else waiting
    return Findings(tuple(rows), note, is_fresh)


def edits_found(
    asker: SensitivityAsker, peaks: Peaks, values: Findings
) -> tuple[Findings, list[tuple[str, str]]]:
    """List the edits that change the active region most, with effects for flags and in words."""
    is_fresh = asker.is_fresh(asker.region)
    edits = [_edit(asker, number, interval) for number, interval in enumerate(peaks.intervals, 1)]
    if peaks.intervals:
        note = ""
    elif is_fresh:
        # Without a peak, the curve is flat or rises towards very rare values.
        flat = peaks.strongest is None
        note = "no edit changes this region" if flat else "no value to suggest"
    else:
        # Said once, above.
        is_coming = asker.engines and not asker.problem
        note = asker.waiting if is_coming and (values.rows or values.is_fresh) else ""
    rows = tuple(row for row, _effect in edits)
    return Findings(rows, note, is_fresh), [effect for _row, effect in edits]


def _edit(asker: SensitivityAsker, number: int, interval: Interval) -> tuple[Row, tuple[str, str]]:
    """Return an edit's row, and its effect for the flag and in words."""
    choices, write = asker.asked.choices, asker.state.value_text
    at = write(interval.value)
    change = interval.predicted(choices.height)
    if choices.measure == "change":
        effect = f"changes by {change_text(change, MOST)}"
    elif asker.asked.over_bright:
        beyond = "> " * (change > MOST) + "< " * (change < -MOST)
        size = short(round(min(max(change, -MOST), MOST), 3), signed=True)
        effect = f"{beyond}{size} over black"
    else:
        effect = brightness_text(change, MOST)
    tip = EDIT_TIP.format(write(interval.low), write(interval.high))
    row = Row((at, effect), tip, badge=str(number))
    return row, (effect, f"Edit {number} at {at}, {effect}; Enter adds it")


def brightness_text(change: float, most: float = 1.0) -> str:
    """Write a change of brightness, 0 to 1, to a thousandth."""
    return f"{'brighter' if change > 0 else 'darker'} by {change_text(change, most)}"


def change_text(change: float, most: float = 1.0) -> str:
    """Write the size of a change of pixel values, up to a limit, to a thousandth."""
    size = abs(change)
    most_text = "> " * (size > most) + short(round(min(size, most), 3))
    return "< .001" if size < LEAST_SHOWN else most_text


def source_text(workspace: Workspace) -> str:
    """Name the engines of the curves, with the curves' colours, and their agreement."""
    asker, choices = workspace.sensitivity, workspace.sensitivity.asked.choices
    hint = asker.hint
    if not choices.shown:
        return ""
    if asker.problem:
        return _warning(asker.problem)
    if choices.engine == "learned" and asker.learned_size is None:
        return "there is no model of this volume: open one, or choose Exact"
    exact, parts = asker.exact_source, []
    name = exact if exact == "exact" else gloss("Other light")
    if exact in asker.regions:
        parts.append(f"<span style='color:{theme.CHANGE}'>━</span> {name}")
    if "learned" in asker.regions:
        parts.append(f"<span style='color:{theme.CHANGE}'>╍</span> {gloss('Learned')}")
        agreement = asker.region_agreement
        if agreement is not None:
            # Outside the model's training, agreement is chance.
            trust = "" if hint and agreement > 0 else f"{_trust_word(agreement)}, "
            parts.append(f"{trust}{gloss('Cosine')} {short(agreement)}")
        elif exact not in asker.regions and not hint:
            folder = workspace.model.folder
            recorded = None if folder is None else recorded_agreement(folder)
            known = "agreement not measured"
            if recorded is not None:
                known = (
                    f"{_trust_word(recorded)} on test images, {gloss('Cosine')} {short(recorded)}"
                )
            parts.append(known)
        if "exact" in asker.order("region") and exact not in asker.regions:
            parts.append(f"{name} …")
        if hint:
            parts.append(_warning("outside what it was trained on"))
    elif asker.asks_model and hint and asker.learned_size is None:
        is_there = workspace.model.scene is not None
        parts.append(f"{gloss('Learned')}: {'not for this range' if is_there else 'loading …'}")
    elif asker.asks_model and asker.learned_size and not asker.asked.outline.is_in_square:
        parts.append(f"{gloss('Learned')}: the region leaves the model's image")
    return " &nbsp; ".join(parts)


def _warning(text: str) -> str:
    return f"<span style='color:{theme.ATTENTION}'>{text}</span>"


def _trust_word(cosine: float) -> str:
    """Say how well a model's response agrees with the exact one."""
    if cosine < 0:
        return "contradicts it"
    return "agrees well" if cosine >= GOOD else "agrees fairly" if cosine >= FAIR else "differs"
