"""Choice of who draws the reference while something moves: the faster, by measured time."""

from __future__ import annotations

SWITCH = 0.7
"""VTK takes over where it needs less than this part of the time that it may take; it gives back
beyond the time divided by it, so that two that are equally fast do not take turns."""

NEWS = 1.25
"""Factor by which a time has to change to be told anew."""


class LiveDrawer:
    """Chooses between VTK and the ray caster for images while something moves.

    VTK draws them with all of its samples, as at rest: where a graphics card does that within a
    frame's time, nothing becomes coarse. Elsewhere the ray caster draws, unless VTK is the faster.

    Attributes
    ----------
    is_vtk : bool
        Whether VTK draws; the ray caster does as long as VTK's time is not known.
    reason : str
        One sentence with both times; empty as long as nobody has drawn.
    """

    def __init__(self) -> None:
        self.forget()

    def forget(self) -> None:
        """Begin anew: another volume, light or renderer is drawn."""
        self.is_vtk, self.reason = False, ""
        self._told: tuple[float, float | None] = 0.0, None

    def choose(self, vtk: float | None, raycast: float | None, seconds: float) -> None:
        """Choose by what an image of the present size takes.

        Parameters
        ----------
        vtk : float or None
            Seconds of VTK's image with all samples; None if not known.
        raycast : float or None
            Seconds of the ray caster's; None if not known.
        seconds : float
            That a live image may take.
        """
        if vtk is None:
            self.forget()
            return
        allowed = max(seconds, raycast or 0.0)
        was_vtk, (vtk_told, raycast_told) = self.is_vtk, self._told
        self.is_vtk = vtk < (allowed / SWITCH if was_vtk else allowed * SWITCH)
        is_known = _near(vtk, vtk_told) and _near(raycast or 0.0, raycast_told or 0.0)
        if is_known and self.is_vtk == was_vtk:
            return
        self._told = vtk, raycast
        other = "" if raycast is None else f", the ray caster {_time(raycast)}"
        drawer = "VTK" if self.is_vtk else "the ray caster"
        self.reason = (
            f"While something moves, {drawer} draws: a whole image takes VTK {_time(vtk)} "
            f"here{other}."
        )


def _near(a: float, b: float) -> bool:
    return a <= NEWS * b and b <= NEWS * a


def _time(seconds: float) -> str:
    return f"{1000 * seconds:.0f} ms" if seconds < 1 else f"{seconds:.1f} s"
