"""What the window remembers between runs, as plain data whose every value is checked by itself."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from app.engines.engines import Drawing
from app.state.exactness import STOPS, USUAL, Stop
from app.state.kept_fields import checks_of, kept, unknown
from app.state.known_volume import KnownVolume, recent_texts
from app.state.value_checks import (
    base64_text,
    checked,
    dict_of,
    either,
    flag,
    list_of,
    one_of,
    text,
    valid_values,
    whole_number,
)
from model.scene.scene import RENDERER_NAMES

FORMAT_VERSION = 2
"""Version of the data."""

MOST_VOLUMES = 300
"""Number of volumes that are remembered; the one opened longest ago gives way."""

ReferenceSize = Literal["generator"] | int | None
"""As many pixels as the generator's image, a number of pixels, or as many as the pane has."""

ThemeChoice = Literal["system", "dark", "light"]
"""The window's colours: the system's, or others."""


def _known_volumes(value: Any) -> dict[str, KnownVolume]:
    """Take what is known of volumes, without those of which it is malformed."""
    if not isinstance(value, dict):
        raise ValueError("it must have names")
    known = {}
    for fingerprint, each in list(value.items())[-MOST_VOLUMES:]:
        if isinstance(each, KnownVolume):
            known[fingerprint] = each
        elif isinstance(each, dict):
            known[fingerprint] = KnownVolume(**valid_values(checks_of(KnownVolume), each))
    return known


@dataclass(frozen=True)
class Remembered:
    """Everything that the window remembers, but for the TFs.

    Attributes
    ----------
    drawing : {"auto", "vtk", "raycast"}
    stop : {"fast", "balanced", "exact"}
        Of the slider from fast to exact.
    reference_size : None, int or "generator"
        Pixels of the reference image, 16 to 8192; None for as many as its pane has.
    denoises : bool
        Whether path-traced pictures are denoised.
    trackball : bool
        Whether dragging turns views freely.
    legend, scale_bar, cube, opacity_images : bool
        Whether images have a colour legend, a scale bar, an orientation cube, and the opacity
        image.
    last_folder : str
        Folder of the last file; empty if there is none.
    window_geometry : str
        Qt's bytes in base64; empty if unknown.
    splitters : dict of tuple of int
        Sizes by the splitter's name.
    swapped : bool
        Whether the two images have changed places.
    theme : {"system", "dark", "light"}
    single_keys : bool
        Whether letters alone are keys of the window.
    recent_volumes, recent_models, recent_transfer_functions, recent_sessions : tuple of str
        Absolute paths, the newest first.
    volumes : dict of KnownVolume
        By fingerprint, the one opened last at the end.
    others : dict
        What this version does not know, to be kept.
    """

    drawing: Drawing = kept(one_of("auto", *RENDERER_NAMES), "auto", in_session=True)
    stop: Stop = kept(one_of(*STOPS), USUAL, in_session=True)
    reference_size: ReferenceSize = kept(
        either(one_of(None, "generator"), whole_number(16, 8192)), None, in_session=True
    )
    denoises: bool = kept(flag, True, in_session=True)
    trackball: bool = kept(flag, False)
    colors_follow_modes: bool = kept(flag, True)
    legend: bool = kept(flag, False, in_session=True)
    scale_bar: bool = kept(flag, False, in_session=True)
    cube: bool = kept(flag, True, in_session=True)
    opacity_images: bool = kept(flag, False, in_session=True)
    last_folder: str = kept(text, "")
    window_geometry: str = kept(base64_text, "")
    splitters: dict[str, tuple[int, ...]] = kept(
        dict_of(list_of(whole_number(0, 1_000_000), 20), 50), dict
    )
    hidden_panes: tuple[str, ...] = kept(list_of(text, 20), (), in_session=True)
    swapped: bool = kept(flag, False, in_session=True)
    theme: ThemeChoice = kept(one_of("system", "dark", "light"), "system")
    single_keys: bool = kept(flag, True)
    recent_volumes: tuple[str, ...] = kept(recent_texts, (), merging="newest_first")
    recent_models: tuple[str, ...] = kept(recent_texts, (), merging="newest_first")
    recent_transfer_functions: tuple[str, ...] = kept(recent_texts, (), merging="newest_first")
    recent_sessions: tuple[str, ...] = kept(recent_texts, (), merging="newest_first")
    volumes: dict[str, KnownVolume] = kept(_known_volumes, dict)
    others: dict[str, Any] = unknown()

    def with_changes(self, changes: dict[str, Any]) -> Remembered:
        """Return a copy with some values changed.

        Raises
        ------
        ValueError
            For a name that there is not, or a value outside its range.
        """
        checks = checks_of(Remembered)
        return replace(self, **{name: checked(checks, name, v) for name, v in changes.items()})

    def to_json(self) -> dict[str, Any]:
        """Return the values as plain data."""
        data = asdict(self)
        data["volumes"] = {
            fingerprint: _with_others(volume) for fingerprint, volume in data["volumes"].items()
        }
        return {"tfscope_preferences": FORMAT_VERSION, **_with_others(data)}

    @classmethod
    def from_json(cls, data: Any) -> Remembered:
        """Rebuild values from :meth:`to_json`'s data; each wrong one is its default.

        Raises
        ------
        ValueError
            When it is not such data at all.
        """
        if not isinstance(data, dict) or "tfscope_preferences" not in data:
            raise ValueError("it does not hold tfscope's settings")
        rest = {name: value for name, value in data.items() if name != "tfscope_preferences"}
        return cls(**valid_values(checks_of(cls), rest))


def _with_others(data: dict[str, Any]) -> dict[str, Any]:
    """Put what this version does not know beside what it knows."""
    known = {name: value for name, value in data.items() if name != "others"}
    return {**data["others"], **known}
