"""Menus behind the names of the generator and the ground truth."""

from __future__ import annotations

from functools import partial

from app.caption_button import CaptionButton
from app.controls import add_action
from app.glosses import open_glossary
from app.window.pane_layout import PaneLayout, Shown


def fill_captions(generator: CaptionButton, reference: CaptionButton, panes: PaneLayout) -> None:
    """Offer to see one of the images alone, and what the generator's error means."""
    _add_alone(generator, panes, "generator")
    _add_alone(reference, panes, "reference")
    explain = partial(open_glossary, generator.window(), "RMSE")
    add_action(generator.menu(), "What is the error (RMSE)?", explain)


def _add_alone(caption: CaptionButton, panes: PaneLayout, shown: Shown) -> None:
    """Add an entry that shows one image alone, or both again."""
    menu = caption.add_menu()
    alone = add_action(
        menu,
        "Show alone",
        lambda: panes.show_images("both" if panes.shown == shown else shown),
    )
    alone.setCheckable(True)

    def show_state() -> None:
        alone.setEnabled(panes.can_compare)
        alone.setChecked(panes.can_compare and panes.shown == shown)

    menu.aboutToShow.connect(show_state)
