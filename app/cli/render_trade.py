"""``render --budget-ms`` and ``--error``: the setting that keeps to a time and an error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.cli.render_order import Drawer, RenderOrder
from model.errors import RenderError
from model.evaluation.prediction import Prediction, chosen_setting
from model.evaluation.tradeoff import all_settings
from model.rendering.raster import Raster
from model.rendering.setting import SettingRenderer
from model.scene.inputs import SceneInputs
from model.scene.light import LightDirection
from model.scene.scene import Lighting
from model.scene.transfer_function import TransferFunction
from model.scene.view import View
from model.scene.volume import Volume


def traded_drawer(
    order: RenderOrder,
    volume: Volume,
    tf: TransferFunction,
    lighting: Lighting,
    light: LightDirection | None,
    size: int,
) -> Drawer:
    """Return what draws at the setting that the first picture is predicted to need.

    Parameters
    ----------
    size : int
        Width and height of the picture in pixels where the order does not say.

    Raises
    ------
    RenderError
        When what else is asked for is a setting already.
    """
    if order.preintegrated or order.sample_distance is not None:
        raise RenderError(
            "A time or an error chooses the samples along a ray; leave --sample-distance and "
            "--preintegrated out."
        )
    renderer = SettingRenderer(volume, lighting, light)
    inputs = order.inputs(tf)
    raster = order.size or Raster(size, size)
    taken: list[tuple[Prediction, float]] = []

    def choose(seen: SceneInputs) -> Prediction:
        settings = all_settings(lighting, order.renderer)
        return chosen_setting(
            renderer, lighting, [seen], raster, settings, order.budget, order.error
        )

    def draw(view: View) -> NDArray[np.float32]:
        seen = replace(inputs, view=view)
        # The pictures of a movie are alike.
        choice = taken[0][0] if taken else choose(seen)
        rgba, seconds = renderer.draw(choice.setting, seen, raster)
        taken[:] = [(choice, seconds)]
        return rgba

    def drawn_by() -> str:
        if not taken:
            return "the ray caster"
        choice, seconds = taken[0]
        error = f"error ~{choice.rmse:.2g}".replace("~0.", "~.") if choice.rmse else "exact"
        who = choice.setting.text(lighting).replace("ray caster", "the ray caster")
        return f"{who}, in {seconds:.2g} s, {error}"

    return Drawer(
        draw,
        inputs,
        volume,
        volume.name,
        lighting,
        order.light or light,
        drawn_by,
        raster,
        renderer.close,
    )
