"""Where a volume comes from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import cast

from model.errors import VolumeError
from model.scene.volume import Volume
from model.volume_files import Component, RawLayout, read_volume
from model.volume_files.shipped import DEFAULT_VOLUME, shipped_volumes


@dataclass(frozen=True)
class VolumeSource:
    """Where a volume comes from, as plain data.

    Attributes
    ----------
    path : Path or None
        File or DICOM folder; None is the shipped default.
    raw : str or None
        Layout of a headerless file, see :meth:`RawLayout.parse`; None where the name says it.
    component : str or None
        "magnitude", or a number from 0, where each voxel has several numbers.
    """

    path: Path | None = None
    raw: str | None = None
    component: str | None = None

    def read(self) -> Volume:
        """Read the volume, the shipped default when none is named.

        Raises
        ------
        VolumeError
            When the options or the file are wrong.
        """
        return read_volume(
            self.path or DEFAULT_VOLUME, raw=self._layout(), component=self._component()
        )

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

    def _component(self) -> Component | None:
        if self.component is None or self.component == "magnitude":
            return cast(Component | None, self.component)
        if not self.component.isdecimal():
            raise VolumeError(
                f"'{self.component}' is not a component; give magnitude, or a number from 0."
            )
        return int(self.component)


def volume_of(fingerprint: str, name: str, source: VolumeSource) -> Volume:
    """Read the volume that a model was trained on: the one named, or the shipped one.

    Raises
    ------
    VolumeError
        When the named volume is another one, or none is named and none of the
        shipped ones fits.
    """
    if source.path is not None:
        volume = source.read()
        if volume.fingerprint != fingerprint:
            raise VolumeError(f"{source.path}: the model was trained on another volume, '{name}'.")
        return volume
    for candidate in shipped_volumes():
        volume = read_volume(candidate)
        if volume.fingerprint == fingerprint:
            return volume
    raise VolumeError(
        f"The model was trained on '{name}', which is not shipped; give its file.",
        volume="FILE",
    )
