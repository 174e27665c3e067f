from __future__ import annotations

from pathlib import Path

from app.window.recent_menu import menu_names


def test_files_of_one_name_are_told_apart_by_their_folders() -> None:
    paths = [Path("/a/engine.nrrd"), Path("/b/engine.nrrd"), Path("/a/fly & co.nrrd")]
    assert menu_names(paths) == ["engine.nrrd  (a)", "engine.nrrd  (b)", "fly && co.nrrd"]
    assert menu_names([]) == []
