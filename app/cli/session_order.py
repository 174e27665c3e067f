"""``render --session``: what a saved session shows, in place of options that were left out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from app.cli.console import warn
from app.cli.render_order import RenderOrder
from app.state.session import Session
from model.errors import RenderError
from model.volume_files.choice import Choice
from model.volume_files.source import VolumeSource


def of_session(order: RenderOrder, path: Path, has_view: bool) -> RenderOrder:
    """Fill in an order from a session: volume, view, TF, light, crop box and legend.

    What the order says itself is kept.

    Parameters
    ----------
    has_view : bool
        Whether the order's view was asked for.

    Raises
    ------
    SessionError
        When the session cannot be read.
    RenderError
        When its volume is nowhere, or a range is chosen beside it.
    """
    if order.volume.is_placed:
        raise RenderError("A session has its own range and scale; leave --range and --scale out.")
    session = Session.load(path)
    memory, settings = session.content.memory, session.content.settings
    if session.wrong:
        names = ", ".join(f"'{name}'" for name in session.wrong)
        warn(f"{path}: its {names} could not be read.")
    lighting = order.lighting
    if lighting is None and memory.lighting != "auto":
        lighting = memory.lighting
    is_lit = lighting not in (None, "none")
    is_model = order.renderer == "generator"
    filled = replace(
        order,
        volume=_source(order.volume, session, path),
        model=order.model or (session.model if is_model else None),
        view=memory.view if memory.view and not has_view else order.view,
        known_tf=None if order.tf else memory.tf,
        fingerprint=session.fingerprint,
        up=memory.up_axis,
        lighting=None if is_model else lighting,
        light=order.light or (memory.light if is_lit else None),
        crop=order.crop or memory.crop,
        brightness=order.brightness or memory.brightness,
        draws_missing=order.draws_missing or memory.draws_missing,
    )
    if filled.is_array:
        return filled
    return replace(
        filled,
        legend=order.legend or settings.legend,
        scale_bar=order.scale_bar or settings.scale_bar,
    )


def _source(given: VolumeSource, session: Session, path: Path) -> VolumeSource:
    if given.path is None and not session.volume.exists():
        raise RenderError(
            f"{path} shows {session.volume}, which is not there any more; give its new place.",
            volume="FILE",
        )
    memory = session.content.memory
    choice = Choice.parse(memory.choice)
    return replace(
        given,
        path=given.path or session.volume,
        raw=given.raw or memory.raw_layout or None,
        component=given.component or choice.component,
        series=given.series or choice.series,
        array=given.array or choice.array,
        time=given.time or choice.time,
        channel=given.channel or choice.channel,
    )
