"""The plan by which engines are asked to draw at each change, declared once."""

from __future__ import annotations

from dataclasses import dataclass

from app.engines.client import EngineClient
from app.state.exactness import STOPS, USUAL, Exactness
from model.rendering.raster import Raster
from model.scene.value_scale import ValueScale

NO_MODEL_SIZE = 512
"""Size of the reference image until its pane's is known, in pixels."""

FIRST_RASTER = Raster(NO_MODEL_SIZE, NO_MODEL_SIZE)
"""Pixels of the reference image until its pane's are known."""


@dataclass(frozen=True)
class DrawingPlan:
    """Choices of user, light and machine that :class:`app.state.dispatcher.Dispatcher` follows.

    Attributes
    ----------
    raster : Raster
        Pixels of the reference at rest.
    is_fixed : bool
        Whether the number of pixels at rest is the user's choice, however long they take.
    may_stand_in : bool
        Whether the ray caster may draw in VTK's place.
    begins_coarse : bool
        Whether the first image at rest follows one of few pixels, as it takes long. Coarse
        images keep the sample distance then.
    most_samples : int
        Of each pixel in path-traced light, which images at rest come to in several steps; 1 for
        other light.
    draws_live : bool
        Whether the reference itself draws while something moves, though the ray caster might
        stand in: path-traced light that is denoised.
    exactness : Exactness
        What images may take while something moves, and owe at rest.
    generator_follows : bool
        Whether the generator draws as many pixels as the reference does, after one sample of each:
        that of path-traced light. While something moves it draws alone, where it is in sight: the
        reference would draw the same twice.
    hidden : frozenset of EngineClient
        Clients whose images nobody sees: they are asked for none.
    scale : {"linear", "log"}
        Scale of the volume that the reference draws. Nothing is asked for under a TF of another
        one, which is there for a moment until the volume follows it.
    """

    raster: Raster = FIRST_RASTER
    is_fixed: bool = False
    may_stand_in: bool = False
    begins_coarse: bool = False
    most_samples: int = 1
    draws_live: bool = False
    exactness: Exactness = STOPS[USUAL]
    generator_follows: bool = False
    hidden: frozenset[EngineClient] = frozenset()
    scale: ValueScale = "linear"
