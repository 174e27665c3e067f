"""Help: the table of keys and gestures, and pages in windows of their own."""

KEYS_WIDTH = 310  # width of the column of keys in pixels, equal in all areas

_TABLE = """
# Files
Ctrl+O, or drop a file on the window | open a volume | Ctrl O | open a volume
# Images
Drag, or arrow keys | turn | Drag | turn
Wheel, or + and − | zoom in on what is under the mouse, zoom out | Wheel | zoom
Click in an image | show the values there | Click | values here
R, then drag in an image | draw a rectangle (L: a lasso) | R | region
Right drag, Ctrl and drag, or Page up and down | roll
Right click, also in a slice | a menu
Middle drag, Shift and drag, or Ctrl and arrow keys | pan
Double click, or Home | return to the first view
F | fit what the TF shows into the image | F | fit
Click a face of the cube | look from there. Drag it to turn
Drag a round handle of the crop box (K) | move that plane
Shift+K | cut by a plane that faces the viewer. Drag its arrow to turn it
O | orthographic view, or perspective
Click, then I or X | isolate what is connected there, or cut it away: a mask
M, then two clicks or a drag, also in a slice | measure their distance. Escape removes it
C | two images, or one. D shows their difference
Shift+O | show or hide the opacity images
Drag the ball in the top bar, or Ctrl, Shift and drag | move the light
# A and B (A)
Click an image | edit its TF
Shift+A | edit the other image's TF
Ctrl+Shift+B | swap A and B
Ctrl+Shift+W | both in one image. Drag the line between them
# Slices (S)
Wheel, or Page up and down | the next slice. With Shift, ten at once | Wheel | next slice
Drag | move the cross-hair | Drag | cross-hair
Double click | this slice alone, or all three | Double click | large
Ctrl and wheel | zoom. F or Home shows all of the slice | Ctrl wheel, F | zoom, fit
Middle drag, or Shift and drag | pan
Right drag | window and level of grey | Right drag | grey
I or X | show the connected voxels alone, or cut them away | I | isolate
Rest the mouse on a voxel | where is its value visible? | Rest | where visible
Click in an image, then up and down | go through what shows there | ↑ ↓ | along the ray
# Drawing a region
Drag | a rectangle, or around something | Drag | draw the region
Escape | draw no region | Esc | cancel
# Regions
Drag its edge or corner | move or resize it | Drag | edge: move, corner: resize, elsewhere: turn
Shift and Delete | remove it | Shift Del | remove
Escape | return to the whole image | Esc | whole image
# Value under the mouse
Hover over the opacity curve | where is this value visible?
With Ctrl, or in What if | what would an edit there change? | Ctrl | what an edit changes
Wheel over the curve | width of the band | Wheel | band width
P, also with Ctrl | keep the value or the edit under the mouse | P | keep
Hold W | what would a mode there change? | W | what if
Drag between the handles | keep a band of several values
Escape, or click between the handles | return to the images
Click a numbered flag | add a mode there
# Transfer function
Drag a mode's peak, or a point | its value and opacity | Drag | move a handle
Drag a square at its side | its width
Double click between the handles | add a mode or point | Double click | add
Ctrl and wheel | zoom the axis. A middle drag moves it, Home shows all of it
Click the colour strip | add a colour stop
Double click a colour stop | choose its colour
Shift and drag, or Ctrl+A | select several. Drag one of them to move all
Arrow keys, faster with Shift | move the selection
Delete | remove the selection | Delete | remove
F2 | type the numbers of the selection. Tab goes on | F2 | numbers
# Line at an end of the TF
Drag | stretch the TF to another range | Drag | stretch the TF
Ctrl and drag | make values beyond the mouse transparent | Ctrl drag | cut: transparent beyond
# Values and edits
▲, ▼ or Isolate in a row | raise, lower or isolate its values | ▲ ▼ | edit
Add in a row | add that mode to the TF | Add | add a mode
Hold W | what would a mode at the value under the mouse change?
F8 | close the panel | F8 | close
# Pictures of TFs (B)
Click a picture | take its TF | Click | take this TF
Wheel over a picture, with the map | divide that cell, or go back
Escape | close | Esc | close
# Map of TFs (B)
Move the mouse over the map | picture and TF of that place
Click | take its TF | Click | take this TF
Wheel over the map | zoom | Wheel | zoom
Drag outside the rectangle, or with Shift | draw a new rectangle | Shift drag | new rectangle
Drag in the rectangle, at its edges | move it, resize it
Middle drag, or Ctrl and drag | move the map
Home | show the whole map
Escape | stop what is running, or else close the map | Esc | close
# Window
F6, Shift and F6 | the next area, the one before
F8 | show or hide values and edits
F9 | fold or unfold the TF editor
F10, or Alt in a narrow window | the menus
Escape | end the last action, or dismiss the newest notice, or else the measured distance
Ctrl+Z | undo an edit. Ctrl+Y redoes it
Ctrl+Shift+S | save a figure. Ctrl+Shift+C copies the image
B | browse TFs
"""
"""Gesture | its effect | both in short, for the status line."""


def _areas() -> dict[str, list[list[str]]]:
    found: dict[str, list[list[str]]] = {}
    for line in _TABLE.strip().splitlines():
        if line.startswith("# "):
            rows = found[line[2:]] = []
        else:
            rows.append(line.split(" | "))
    return found


GESTURES = _areas()  # rows of the table by area


def status_keys(area: str) -> str:
    """Return an area's gestures for the status line: "[Drag] turn  [Wheel] closer"."""
    shown = [row[2:] for row in GESTURES[area] if row[2:]]
    return "  ".join(f"[{keys}] {effect}" for keys, effect in shown)


def help_text(wanted: str = "") -> str:
    """Return the help page, or its rows that have all of some words."""
    words = wanted.lower().split()
    parts = []
    for area, gestures in GESTURES.items():
        rows = [
            f"<tr><td width='{KEYS_WIDTH}'>{keys}</td><td>{effect}</td></tr>"
            for keys, effect, *_ in gestures
            if all(word in f"{area} {keys} {effect}".lower() for word in words)
        ]
        if rows:
            parts.append(f"<h3>{area}</h3><table cellspacing='6'>{''.join(rows)}</table>")
    return "".join(parts) or "<p>No entry has these words.</p>"


ABOUT = """<h3>tfscope</h3>
<p>Renders volumes through transfer functions, and shows which scalar values make up any
part of the picture.</p>
<p>Its models follow M. Berger, J. Li and J. A. Levine, <i>A Generative Model for Volume
Rendering</i>, IEEE TVCG 2018. VTK or tfscope's own ray caster renders the ground truth.</p>
<p>BSD 3-Clause licence.</p>"""
