"""The paper's studies (section 6.3) of losses, latent dimensions and loss weights.

A study trains one model per variant, on the same samples with the same budget, and measures all on
the same hold-out samples. Each variant has its own folder: finished ones are kept, stopped ones are
resumed. A collapsed one is measured in its last good state.
"""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from model.errors import CollapseError, TrainingError
from model.evaluation.holdout import generator_errors, nearest_images, neighbor_errors, pictures
from model.files import write_atomically
from model.generator.generator import Generator
from model.json_files import build, read_json
from model.metrics import clearly_seen
from model.networks.card import MODEL_FILE
from model.samples.sample_store import SampleBatch, SampleStore
from model.samples.sampling import draw_sample
from model.scene.volume import Volume
from model.sensitivity.agreement import sensitivity_agreement
from model.training.options import TrainingOptions, flattened
from model.training.plan import TrainingPlan, TrainingReport
from model.training.state import STATE_FILE, load_progress
from model.training.trainer import train

OnReport = Callable[[TrainingReport], None]
MEASURES = ("rmse", "emd", "ssim", "opacity_rmse")
OUTCOME_FILE = "outcome.json"  # budget and recipe of a variant, and how it collapsed

RESULT_FILE = "result.json"


@dataclass(frozen=True)
class Variant:
    """One model of a study, in a folder of its name; `paper` has its RMSE and colour EMD there."""

    name: str
    label: str
    settings: tuple[str, ...] = ()  # changes of the recipe, see `TrainingOptions.with_settings`
    latent_dim: int | None = None
    paper: tuple[float, float] | None = None
    two_stage_settings: tuple[str, ...] = ()  # further ones if opacity has its own stage

    def changes(self, options: TrainingOptions) -> tuple[str, ...]:
        """Return all changes of a recipe."""
        return self.settings + (() if options.one_stage else self.two_stage_settings)


@dataclass(frozen=True)
class Study:
    """A study and its variants."""

    title: str
    paper: str  # data of the paper's numbers
    variants: tuple[Variant, ...]
    neighbor: tuple[float, float] | None = None  # image RMSE and colour EMD of the nearest image
    varied: str = ""  # meaning of the labels, if they are numbers


ADVERSARY, NO_ADVERSARY = "adversarial_start=0", "adversarial_start=1"
NO_IMAGE_LOSS = "l1_weight=0", "opacity_l1_weight=0"

L1 = Variant(
    "l1",
    "l1",
    (NO_ADVERSARY,),
    paper=(0.047, 0.007),
    # Without an adversary, nothing else would teach the opacity images of the first stage.
    two_stage_settings=("opacity_l1_weight=150",),
)
GAN = Variant("gan", "GAN", (ADVERSARY, *NO_IMAGE_LOSS), paper=(0.060, 0.017))
GAN_L1 = Variant("gan-l1", "GAN + l1", (ADVERSARY, "l1_weight=150"), paper=(0.060, 0.011))

STUDIES: dict[str, Study] = {
    "baselines": Study(
        "Nearest neighbour, l1, adversarial loss, and both (section 6.3.1, Table 3)",
        "Combustion, direct illumination, 256 x 256",
        (L1, GAN, GAN_L1),
        neighbor=(0.059, 0.020),
    ),
    "latent-dim": Study(
        "Dimension of the opacity TF's latent code (section 6.3.2, Fig. 14)",
        "Combustion, no illumination, 64 x 64; a figure without numbers; 8 is best",
        tuple(
            replace(
                GAN,
                name=GAN.name if dimension == 8 else f"gan-latent-{dimension}",
                label=str(dimension),
                latent_dim=dimension,
                paper=None,
            )
            for dimension in (4, 8, 16, 32, 64)
        ),
        varied="dimension of the latent code",
    ),
    "l1-weight": Study(
        "Weight of the l1 loss next to the adversarial one (section 6.3.3, Table 4)",
        "Combustion, no illumination, 256 x 256",
        (
            Variant("l1-50", "50", (ADVERSARY, "l1_weight=50"), paper=(0.050, 0.015)),
            replace(GAN_L1, label="150", paper=(0.046, 0.011)),
            Variant("l1-450", "450", (ADVERSARY, "l1_weight=450"), paper=(0.044, 0.012)),
        ),
        varied="weight of the l1 loss",
    ),
}
"""Studies by their names on the command line."""


@dataclass(frozen=True)
class StudyPlan:
    """Data, training plan and measurements of a study."""

    store: SampleStore
    volume: Volume
    base: TrainingPlan  # a variant changes options or size, in a subfolder
    count: int  # hold-out samples that are measured
    sensitivities: int  # number of these that are also compared with exact sensitivities

    def training(self, variant: Variant) -> TrainingPlan:
        """Return the training plan of a variant."""
        size = self.base.size
        if variant.latent_dim is not None:
            size = replace(size, latent_dim=variant.latent_dim)
        return replace(
            self.base,
            size=size,
            options=self.base.options.with_settings(variant.changes(self.base.options)),
            folder=self.base.folder / variant.name,
        )


def run_study(
    study: Study,
    plan: StudyPlan,
    on_variant: Callable[[Variant], None] = lambda variant: None,
    on_report: OnReport = lambda report: None,
) -> dict[str, Any]:
    """Train and measure all variants that are not finished yet; return the results as plain data.

    `on_variant` is called before a variant is trained, `on_report` after each optimization step.
    """
    samples = plan.store.read("holdout", range(plan.count))
    rows = {}
    for variant in study.variants:
        on_variant(variant)
        rows[variant.name] = _row(plan, variant, samples, on_report)
    neighbor = {"count": plan.store.count("train"), **_means(neighbor_errors(samples, plan.store))}
    return {
        "title": study.title,
        "volume": plan.store.scene.volume_name,
        "preset": plan.base.preset,
        "image_size": plan.base.size.image_size,
        "minutes": plan.base.budget.minutes,
        "samples": plan.base.budget.samples,
        "lighting": plan.store.scene.lighting,
        "training_images": plan.store.count("train"),
        "holdout_count": plan.count,
        "options": asdict(plan.base.options),
        "nearest_neighbor": neighbor,
        "variants": rows,
    }


def _row(
    plan: StudyPlan, variant: Variant, samples: SampleBatch, on_report: OnReport
) -> dict[str, Any]:
    """Return a variant's result from disk, or train and measure it."""
    training = plan.training(variant)
    outcome = _trained(training, on_report)
    path = training.folder / RESULT_FILE
    asked = {"count": plan.count, "sensitivities": plan.sensitivities}
    if path.is_file():
        row: dict[str, Any] = read_json(path)
        if row["asked"] == asked:
            return row
    row = {"asked": asked, **outcome}
    if (training.folder / MODEL_FILE).is_file():
        generator = Generator.load(training.folder, training.device.type)
        row |= _means(generator_errors(generator, samples)) | _agreement(generator, plan)
        row["samples_seen"] = generator.card.training["samples_seen"]
    write_atomically(path, json.dumps(row, indent=2).encode())
    return row


def _trained(training: TrainingPlan, on_report: OnReport) -> dict[str, Any]:
    """Train unless finished; the result has an error message "collapsed" if training collapsed."""
    path = training.folder / OUTCOME_FILE
    outcome: dict[str, Any] = {"budget": asdict(training.budget), "recipe": training.recipe()}
    if path.is_file():
        found = read_json(path)
        if found["budget"] != outcome["budget"]:
            raise TrainingError(
                f"{training.folder}: this model is trained with another budget; "
                "give the same, or choose another folder."
            )
        training.check_recipe(found["recipe"])
        outcome = found
    else:
        training.folder.mkdir(parents=True, exist_ok=True)
        write_atomically(path, json.dumps(outcome, indent=2).encode())
    begun = (training.folder / STATE_FILE).exists()
    is_done = begun and load_progress(training.folder)[0].stage == "done"
    if not is_done and "collapsed" not in outcome:
        try:
            train(training, begun, on_report)
        except CollapseError as error:
            outcome["collapsed"] = str(error)
            write_atomically(path, json.dumps(outcome, indent=2).encode())
    return outcome


def _means(errors: dict[str, NDArray[np.float64]]) -> dict[str, float]:
    return {name: float(errors[name].mean()) for name in MEASURES if name in errors}


def _agreement(generator: Generator, plan: StudyPlan) -> dict[str, float]:
    """Median cosine similarities to the renderer's sensitivities, of images and of blocks."""
    if not plan.sensitivities:
        return {}
    scene, seed = plan.store.scene, plan.store.seed
    samples = [draw_sample(scene, seed, "holdout", i) for i in range(plan.sensitivities)]
    found = sensitivity_agreement(generator, plan.volume, samples).to_json()
    return {name: found[name]["median"] for name in ("image_cosine", "block_cosine")}


def study_table(study: Study, result: dict[str, Any]) -> list[list[str]]:
    """Return the results and the paper's numbers as rows of cells, the heading first."""
    heading = ["", "samples", "RMSE", "EMD", "SSIM", "opacity RMSE", "cosine image", "blocks"]
    rows = [[*heading, "paper's RMSE", "EMD"]]
    neighbor = result["nearest_neighbor"]
    label = f"nearest of {neighbor['count']:,}"
    rows.append([label, "", *_cells(neighbor), *_paper(study.neighbor)])
    for variant in study.variants:
        row = result["variants"][variant.name]
        seen = f"{row['samples_seen']:,}" if "samples_seen" in row else ""
        label = f"{variant.label} (collapsed)" if "collapsed" in row else variant.label
        rows.append([label, seen, *_cells(row), *_paper(variant.paper)])
    return rows


def markdown(study: Study, result: dict[str, Any]) -> str:
    """Return the table in Markdown, with the study's settings above and the recipe beneath."""
    heading, *rows = study_table(study, result)
    budget = f"{result['samples']:,} samples"
    if result["minutes"] is not None:
        budget = f"{result['minutes']:g} minutes"
    lines = [
        f"{study.title}. {result['volume']}, lighting {result['lighting']}, preset "
        f"{result['preset']} ({result['image_size']} x {result['image_size']}), "
        f"{budget} for each, {result['holdout_count']} hold-out samples. "
        f"Paper: {study.paper}.",
        "",
        *(f"| {' | '.join(cells)} |" for cells in (heading, ["---"] * len(heading), *rows)),
    ]
    for variant in study.variants:
        why = result["variants"][variant.name].get("collapsed")
        if why is not None:
            lines += ["", f"{variant.label} collapsed, and was measured as far as it came. {why}"]
    for line in recipe_lines(study, result):
        lines += ["", line]
    return "\n".join(lines) + "\n"


def recipe_lines(study: Study, result: dict[str, Any]) -> list[str]:
    """Return the recipe of all variants, and what each changes, as two sentences."""
    options = build(TrainingOptions, result["options"])
    changes = "; ".join(
        f"{variant.label}: {', '.join(parts)}"
        for variant in study.variants
        if (parts := _changes(variant, options))
    )
    settings = (
        f"{name}={str(value).lower() if isinstance(value, bool) else f'{value:g}'}"
        for name, value in flattened(asdict(options)).items()
    )
    return [f"Recipe of all: {', '.join(settings)}.", f"Changed by each: {changes}."]


def _changes(variant: Variant, options: TrainingOptions) -> list[str]:
    dimension = variant.latent_dim
    codes = [] if dimension is None else [f"codes of {dimension} numbers"]
    return [*variant.changes(options), *codes]


def _cells(row: dict[str, Any]) -> list[str]:
    """Cells of a row's errors and cosines; empty if not measured."""
    return [
        *(_number(row.get(name), 4 if name == "emd" else 3) for name in MEASURES),
        *(_number(row.get(name), 2) for name in ("image_cosine", "block_cosine")),
    ]


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"


def _paper(numbers: Sequence[float] | None) -> list[str]:
    return ["", ""] if numbers is None else [f"{number:.3f}" for number in numbers]


PICTURED = 4  # samples that are shown


def study_pictures(study: Study, plan: StudyPlan) -> dict[str, NDArray[np.floating]]:
    """Draw the first non-empty hold-out samples by all models of a finished study."""
    samples = plan.store.read("holdout", range(plan.count))
    shows = clearly_seen(samples.rgba)
    shown = samples[np.flatnonzero(shows if shows.any() else ~shows)[:PICTURED]]
    columns: dict[str, NDArray[np.floating]] = {
        "ground truth": shown.rgba[..., :3] / 255,
        "nearest neighbour": nearest_images(shown.rgba, plan.store)[..., :3] / 255,
    }
    for variant in study.variants:
        folder = plan.training(variant).folder
        if (folder / MODEL_FILE).is_file():
            generator = Generator.load(folder, plan.base.device.type)
            columns[variant.label] = pictures(generator, shown)
    return columns
