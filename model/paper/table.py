"""Tables of the paper with ours beside, as plain rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Table:
    """A table to print, and to write as Markdown.

    Attributes
    ----------
    rows : tuple of tuple of str
        As long as the heading.
    notes : tuple of str
        Sentences below it: what was measured, and where it differs from the paper.
    """

    title: str
    heading: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def markdown(self) -> str:
        """Return the table with its title and notes in Markdown."""
        lines = [f"**{self.title}**", "", _line(self.heading)]
        lines += [_line(["---"] * len(self.heading)), *map(_line, self.rows)]
        for note in self.notes:
            lines += ["", note]
        return "\n".join(lines) + "\n"

    def to_json(self) -> dict[str, Any]:
        """Return the table as plain data: a dict per row."""
        rows = [dict(zip(self.heading, row, strict=True)) for row in self.rows]
        return {"title": self.title, "rows": rows, "notes": list(self.notes)}


def _line(cells: list[str] | tuple[str, ...]) -> str:
    return f"| {' | '.join(cells)} |"
