"""Scene inputs as files keep them: each a list of numbers, empty for none."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass
from typing import Any, Literal, get_args

from app.state.value_checks import Check, list_of, number
from model.errors import TfscopeError
from model.scene.crop import CropBox
from model.scene.light import LightDirection
from model.scene.view import View

KeptInput = Literal["view", "light", "crop"]
"""Names of :class:`~model.scene.inputs.SceneInputs` that are kept as numbers."""

KEPT_INPUTS: tuple[KeptInput, ...] = get_args(KeptInput)


@dataclass(frozen=True)
class _Form:
    counts: range
    each: Callable[[Any], float]
    numbers: Callable[[Any], tuple[float, ...]]
    build: Callable[..., Any]


_FORMS: dict[str, _Form] = {
    "view": _Form(range(1, 7), number(-1e9, 1e9), astuple, View),
    "light": _Form(range(2, 3), number(-180, 180), astuple, LightDirection),
    "crop": _Form(
        range(6, 7),
        number(0.0, 1.0),
        lambda crop: (*crop.low, *crop.high),
        lambda *planes: CropBox(planes[:3], planes[3:]),
    ),
}


def numbers_of(name: KeptInput, value: Any) -> tuple[float, ...]:
    """Return an input's numbers; none of None."""
    return () if value is None else _FORMS[name].numbers(value)


def input_of(name: KeptInput, numbers: Sequence[float]) -> Any:
    """Return the input that has these numbers; None of none.

    What the end of a view lacks is as at first.

    Raises
    ------
    ValueError
        When there is no such input.
    """
    if not numbers:
        return None
    if len(numbers) not in _FORMS[name].counts:
        raise ValueError(f"it must have {_FORMS[name].counts[-1]} numbers")
    try:
        return _FORMS[name].build(*numbers)
    except TfscopeError as error:
        raise ValueError(str(error)) from None


def input_check(name: KeptInput) -> Check:
    """Return a check that a value from a file is empty or has an input's numbers."""
    form = _FORMS[name]

    def check(value: Any) -> tuple[float, ...]:
        numbers = list_of(form.each, form.counts[-1])(value)
        input_of(name, numbers)
        return numbers

    return check
