"""``info``: description of a volume file or a model folder."""

import json
from dataclasses import dataclass
from typing import Any

from app.cli import options
from app.cli.evaluate import MEASURES
from app.cli.options import option
from app.cli.values import range_text
from model.networks.card import MODEL_FILE, ModelCard, errors_by_kind
from model.scene.ranges import robust_range
from model.scene.scene import RENDERER_NAMES
from model.scene.value_scale import LOGARITHM_OFFER, SCALE_NAMES, suits_logarithm, values_at
from model.volume_files.choice import as_data, describe
from model.volume_files.source import VolumeSource


@dataclass(frozen=True, kw_only=True)
class Info:
    """Print what a volume file or a model folder holds."""

    source: VolumeSource = options.volume(
        *("scalar_range", "scale"),
        path=options.argument("A volume or a model.", metavar="FILE_OR_MODEL"),
    )
    as_json: bool = option("Print it as JSON, for programs.", default=False, flag="--json")

    def run(self) -> None:
        """Print a model's card, or a volume's description, as a table or as JSON."""
        path = self.source.path
        if path is not None and (path / MODEL_FILE).exists():
            # Imported late: a volume's description needs no networks.
            from model.networks.blocks import parameter_count
            from model.networks.checkpoint import load_model

            card, network = load_model(path)
            rows = [*_card_rows(card), ("parameters", f"{parameter_count(network):,}")]
            self._print(rows, dict(rows))
            return
        volume = self.source.read_whole()
        shown, is_offered = robust_range(volume), suits_logarithm(volume.distribution)
        rows = describe(volume)
        if shown != volume.data_range:
            why = "each label on a bin" if volume.file.is_labels else "without outliers"
            rows.append(("shown over", f"{range_text(shown, volume.scale)}, {why}"))
        if is_offered:
            rows.append(("scale", f"{LOGARITHM_OFFER} (--scale log)"))
        found = {"shown_range": list(shown), "suits_logarithm": is_offered}
        self._print(rows, {"path": str(path), **as_data(volume), **found})

    def _print(self, rows: list[tuple[str, str]], data: dict[str, Any]) -> None:
        if self.as_json:
            print(json.dumps(data, indent=1))
        else:
            from app.cli.console import print_facts

            print_facts(str(self.source.path), rows)


def _card_rows(card: ModelCard) -> list[tuple[str, str]]:
    scene, size, course = card.scene, card.size, card.training
    between = "{:.10g} to {:.10g}".format
    window = between(*values_at(scene.scalar_window, scene.scale))
    families = {"paper": "the paper's mixtures", "drawn": "as people draw them"}
    rows = [
        ("volume", scene.volume_name),
        ("scalar range", between(*values_at(scene.scalar_range, scene.scale))),
        *([("scale", f"over {SCALE_NAMES[scene.scale]}")] if scene.scale != "linear" else []),
        ("random TFs", f"{families[scene.tf_family]}; peaks at values from {window}"),
        ("lighting", scene.lighting + (", movable light" if scene.light_range else "")),
        ("views", f"with {scene.view_range.up} up"),
        ("rendered by", RENDERER_NAMES[scene.renderer]),
        ("preset", f"{card.preset} (width {size.width:g} of the paper's)"),
        ("colour image", f"{size.image_size} x {size.image_size}"),
        ("opacity image", f"{size.opacity_size} x {size.opacity_size}"),
        ("latent code", f"{size.latent_dim} numbers"),
    ]
    name = "training"
    while isinstance(course.get("seconds"), int | float):
        of_stored = "samples_stored" in course
        supply = f"of {course['samples_stored']:,} stored" if of_stored else "rendered meanwhile"
        spent = f"{course['seconds'] / 60:.0f} minutes on {course['device']}"
        rows.append((name, f"{spent}, {course['samples_seen']:,} samples seen, {supply}"))
        name, course = "before that", course.get("start", {})
    rows.append(("errors", "hold-out means; 0 is best (SSIM: 1); shipped models: image RMSE .07"))
    for name, value in card.metrics.get("holdout", {}).items():
        rows.append((MEASURES.get(name, name), f"{value:.4f}"))
    for name, error in errors_by_kind(card.metrics).items():
        rows.append((f"image RMSE, {name}", f"{error:.4f}"))
    return rows
