"""Facts of the map and its pictures, in words."""

from __future__ import annotations

from app.state.latent_pictures import GridPicture, LatentPictures
from app.state.latent_session import LatentSession
from app.state.latent_state import LatentState
from model.latent.latent_map import LatentMap

SOURCES = {"exact": "ray caster", "learned": "model"}


def count_of(session: LatentSession, map_: LatentMap) -> str:
    """Return how many TFs the map has, and how many of them are wanted."""
    count = f"{len(map_.samples.codes):,}"
    if session.wanted is not None and not session.wanted.all():
        return f"{session.wanted.sum():,} of {count}"
    return count


def facts_of(
    session: LatentSession, map_: LatentMap, pictures: LatentPictures, latent: LatentState
) -> tuple[list[str], list[str]]:
    """Return facts of a few words, and sentences that explain them."""
    samples = map_.samples
    facts = [f"{count_of(session, map_)} TFs"]
    dimensions, effective = samples.codes.shape[1], samples.effective_dimension
    singular = ", ".join(f"{value:.2g}" for value in samples.singular_values)
    explained = [
        f"The map shows {dimensions} dimensions of codes, of which {effective:.1f} are used.\n"
        f"Singular values of the codes: {singular}."
    ]
    if not map_.is_final:
        facts.append("principal components only")
    if session.place is not None:
        near = "" if session.is_exact else ", about here"
        facts.append(f"present TF{near} (differs by {session.place_error:.3f})")
        explained.append(
            "The present TF differs from the nearest that can be browsed by so much opacity "
            "(root mean square)."
        )
    grid = pictures.grid
    if grid is not None and grid.images:
        if latent.hover is None:
            # Both do not have room.
            facts.append(_of_grid(grid))
        size = next(iter(grid.images.values())).shape[0]
        explained.append(
            f"Pictures of the grid have {size} × {size} pixels; the number in a corner\n"
            "is how many of the TFs lie in that cell of the frame."
        )
    if latent.hover is not None:
        x, y = latent.hover
        facts.append(f"({x:.2f}, {y:.2f})")
    return facts, explained


def _of_grid(grid: GridPicture) -> str:
    of = " from codes" if grid.of_codes else ""
    drawn = f"{len(grid.images)} pictures by the {SOURCES[grid.source]}{of}"
    return f"{drawn} in {1000 * grid.seconds:.0f} ms"
