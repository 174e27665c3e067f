"""Source of a volume: a file and its reading options."""

from dataclasses import dataclass
from pathlib import Path

from model.errors import VolumeError
from model.scene.ranges import RangeChoice, robust_range
from model.scene.scene import Scene
from model.scene.value_scale import SCALE_NAMES, ValueScale
from model.scene.volume import Volume
from model.volume_files import Choice, RawLayout, is_known, read_volume, unknown_kind
from model.volume_files.finish import component_of
from model.volume_files.grid import typed_spacing, typed_stretch
from model.volume_files.shipped import DEFAULT_VOLUME, shipped_volumes


@dataclass(frozen=True)
class VolumeSource(Choice):
    """Source of a volume as plain data: its file, what to read of it, and its range and scale.

    Without a path it is the shipped default. `raw` is for :meth:`RawLayout.parse`, the range for
    :meth:`RangeChoice.parse`; without one it is the robust one.
    """

    path: Path | None = None
    raw: str | None = None
    scalar_range: str | None = None
    scale: ValueScale | None = None

    def read(self) -> Volume:
        """Read the volume, over its range; raise VolumeError for invalid options or files."""
        choice = self._range()
        volume = self.read_whole().on_scale(self.scale or "linear")
        return volume.over(robust_range(volume) if choice is None else choice.of(volume))

    @property
    def is_placed(self) -> bool:
        """Whether the range or the scale was chosen."""
        return self.scalar_range is not None or self.scale is not None

    def read_whole(self) -> Volume:
        """Read the volume over the range of all its voxels; see :meth:`read`."""
        path = self.path or DEFAULT_VOLUME
        return read_volume(path, raw=self._layout(), choice=self)

    def check(self) -> None:
        """Raise VolumeError for invalid options and for files that are obviously no volumes."""
        self._layout()
        component_of(self.component)
        self._range()
        if self.spacing is not None:
            typed_spacing(self.spacing)
        if self.stretch is not None:
            typed_stretch(self.stretch)
        if self.path is not None and not self.path.exists():
            raise VolumeError(f"{self.path}: there is no such file or folder; check the path.")
        if self.path and self.raw is None and self.path.is_file() and not is_known(self.path):
            raise unknown_kind(self.path)

    def _range(self) -> RangeChoice | None:
        return None if self.scalar_range is None else RangeChoice.parse(self.scalar_range)

    def _layout(self) -> RawLayout | None:
        if self.raw is None:
            return None
        layout = RawLayout.parse(self.raw)
        if layout is None:
            raise VolumeError(
                f"'{self.raw}' is not the layout of a raw file; "
                "give dimensions, type and byte order, such as 256x256x110_uint16_big."
            )
        return layout


def volume_of(scene: Scene, source: VolumeSource) -> Volume:
    """Read the volume of a model's scene, over its range; VolumeError for any other."""
    if source.scale not in (None, scene.scale):
        raise VolumeError(
            f"The model was trained on {SCALE_NAMES[scene.scale]} of '{scene.volume_name}'; "
            "do not give another scale.",
            scale=scene.scale,
        )
    if source.path is not None:
        volume = source.read_whole()
        if volume.fingerprint != scene.volume_fingerprint:
            raise VolumeError(
                f"{source.path}: the model was trained on another volume, '{scene.volume_name}'."
            )
        return volume.over(scene.scalar_range, scene.scale)
    for candidate in shipped_volumes():
        volume = read_volume(candidate)
        if volume.fingerprint == scene.volume_fingerprint:
            return volume.over(scene.scalar_range, scene.scale)
    raise VolumeError(
        f"The model was trained on '{scene.volume_name}', which is not shipped; give its file.",
        volume="FILE",
    )
