"""Help: the table of keys and gestures, and pages in windows of their own."""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtWidgets import QDialog, QLineEdit, QWidget

from app.glosses import open_page

KEYS_WIDTH = 310
"""Pixels of the column of keys, the same in all areas."""


@dataclass(frozen=True)
class Gesture:
    """Keys or mouse and their effect, in full for the help, and short for the status line."""

    keys: str
    effect: str
    short: tuple[str, str] | tuple[()] = ()


GESTURES: dict[str, tuple[Gesture, ...]] = {
    "Files": (
        Gesture(
            "Ctrl+O, or drop a file on the window", "open a volume", ("Ctrl O", "open a volume")
        ),
    ),
    "Images": (
        Gesture("Drag, or arrow keys", "turn", ("Drag", "turn")),
        Gesture(
            "Wheel, or + and −",
            "zoom in on what is under the mouse, zoom out",
            ("Wheel", "zoom"),
        ),
        Gesture("Click in an image", "show the values there", ("Click", "values here")),
        Gesture("R, then drag in an image", "draw a rectangle (L: a lasso)", ("R", "region")),
        Gesture("Right drag, or Ctrl and drag; Page up, down", "roll"),
        Gesture("Middle drag, or Shift and drag; Ctrl and arrow keys", "pan"),
        Gesture("Double click, or Home", "return to the first view"),
        Gesture("Click a face of the cube", "look from there; drag it to turn"),
        Gesture("Drag a round handle of the crop box (K)", "move that plane"),
        Gesture("C, D", "both images or one; their difference"),
        Gesture("O", "show or hide the opacity images"),
        Gesture("Drag the ball in the top bar, or Ctrl, Shift and drag", "move the light"),
    ),
    "Drawing a region": (
        Gesture("Drag", "a rectangle, or around something", ("Drag", "draw the region")),
        Gesture("Escape", "draw no region", ("Esc", "cancel")),
    ),
    "Regions": (
        Gesture(
            "Drag its edge or corner",
            "move or resize it",
            ("Drag", "edge: move, corner: resize, elsewhere: turn"),
        ),
        Gesture("Shift and Delete", "remove it", ("Shift Del", "remove")),
        Gesture("Escape", "return to the whole image", ("Esc", "whole image")),
    ),
    "Value under the mouse": (
        Gesture("Hover over the opacity curve", "where is this value visible?"),
        Gesture(
            "With Ctrl, or in What if",
            "what would an edit there change?",
            ("Ctrl", "what an edit changes"),
        ),
        Gesture("Wheel over the curve", "width of the band", ("Wheel", "band width")),
        Gesture("P", "keep the value under the mouse", ("P", "keep")),
        Gesture("Hold W", "what would a mode there change?", ("W", "what if")),
        Gesture("Drag between the handles", "keep a band of several values"),
        Gesture("Escape, or click between the handles", "return to the images"),
        Gesture("Click a numbered flag", "add a mode there"),
    ),
    "Transfer function": (
        Gesture(
            "Drag a mode's peak, or a point", "its value and opacity", ("Drag", "move a handle")
        ),
        Gesture("Drag a square at its side", "its width"),
        Gesture("Double click between the handles", "add a mode or point", ("Double click", "add")),
        Gesture("Drag a line at an end of the range", "stretch the TF (with Ctrl: cut it)"),
        Gesture("Ctrl and wheel, middle drag; Home", "zoom and move the axis; all of it"),
        Gesture("Click the colour strip", "add a colour stop"),
        Gesture("Double click a colour stop", "choose its colour"),
        Gesture("Arrow keys, faster with Shift", "move the selection"),
        Gesture("Delete", "remove the selection", ("Delete", "remove")),
        Gesture("F2", "type the numbers of the selection; Tab goes on", ("F2", "numbers")),
    ),
    "Values and edits": (
        Gesture("▲, ▼ or Isolate in a row", "raise, lower or isolate its values", ("▲ ▼", "edit")),
        Gesture("Add in a row", "add that mode to the TF", ("Add", "add a mode")),
        Gesture("Hold W", "what would a mode at the value under the mouse change?"),
        Gesture("F8, or Escape", "close the panel", ("F8", "close")),
    ),
    "Map of TFs (B)": (
        Gesture("Move the mouse over the map", "picture and TF of that place"),
        Gesture("Click", "take its TF", ("Click", "take this TF")),
        Gesture("Wheel over the map", "zoom", ("Wheel", "zoom")),
        Gesture(
            "Drag outside the rectangle, or with Shift",
            "draw a new rectangle",
            ("Shift drag", "new rectangle"),
        ),
        Gesture("Drag in the rectangle, at its edges", "move it, resize it"),
        Gesture("Middle drag, or Ctrl and drag", "move the map"),
        Gesture("Wheel over a picture of the grid", "divide that cell, or go back"),
        Gesture("Home", "show the whole map"),
        Gesture("Escape", "stop what is running; close the map", ("Esc", "close")),
    ),
    "Window": (
        Gesture("F6, Shift and F6", "the next area, the one before"),
        Gesture("F8", "show or hide values and edits"),
        Gesture("F9", "fold or unfold the TF editor"),
        Gesture("F10, or Alt in a narrow window", "the menus"),
        Gesture("Escape", "end the last action; dismiss the newest notice"),
        Gesture("Ctrl+Z; Ctrl+Y", "undo, redo an edit; for the view, Home"),
        Gesture("Ctrl+Shift+S", "save or copy a figure"),
        Gesture("B", "browse TFs"),
    ),
}
"""By area; in each, those of the status line first."""


def status_keys(area: str) -> str:
    """Return an area's gestures for the status line: "[Drag] turn  [Wheel] closer"."""
    shown = [gesture.short for gesture in GESTURES[area] if gesture.short]
    return "  ".join(f"[{keys}] {effect}" for keys, effect in shown)


def help_text(wanted: str = "") -> str:
    """Return the help's page, or what in it has all of some words."""
    words = wanted.lower().split()
    parts = []
    for area, gestures in GESTURES.items():
        rows = [
            f"<tr><td width='{KEYS_WIDTH}'>{gesture.keys}</td><td>{gesture.effect}</td></tr>"
            for gesture in gestures
            if all(word in f"{area} {gesture.keys} {gesture.effect}".lower() for word in words)
        ]
        if rows:
            parts.append(f"<h3>{area}</h3><table cellspacing='6'>{''.join(rows)}</table>")
    return "".join(parts) or "<p>There is none with these words.</p>"


ABOUT = """<h3>tfscope</h3>
<p>Volume rendering with transfer functions, next to a generative model of the
renderings.</p>
<p>After M. Berger, J. Li and J. A. Levine, <i>A Generative Model for Volume
Rendering</i>, IEEE TVCG 2018. The ground truth is rendered by VTK or by
 tfscope's own ray caster.</p>
<p>BSD 3-Clause licence.</p>"""


def show_gestures(window: QWidget) -> QDialog:
    """Show all keys and gestures, to be searched."""
    wanted = QLineEdit()
    wanted.setPlaceholderText("Search")
    wanted.setAccessibleName("Search keys and gestures")
    wanted.setClearButtonEnabled(True)
    page, dialog = open_page(window, "Keys and gestures", help_text(), wanted)
    wanted.textChanged.connect(lambda text: page.setHtml(help_text(text)))
    wanted.setFocus()
    return dialog


def show_about(window: QWidget) -> QDialog:
    """Show what tfscope is."""
    return open_page(window, "About tfscope", ABOUT)[1]
