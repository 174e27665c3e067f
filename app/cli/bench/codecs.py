"""``bench codecs``: codecs for browsing, of several kinds and lengths."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from app.cli.bench.machine import print_machine
from app.cli.console import console, print_table
from app.cli.outputs import write_json
from model.benchmarks.codec_browsing import BrowsingRow, compare_designs, measure_browsing
from model.latent.codec_folder import load_codec
from model.latent.codes import TFCodec
from model.training.codec_training import CodecDesign

DESIGNS = {
    "plain": CodecDesign("plain", width=0.5),
    "contractive": CodecDesign("contractive", width=0.5),
    "variational": CodecDesign(width=0.5),
    "variational, weak prior": CodecDesign(width=0.5, prior_weight=1e-4),
    "variational, wider": CodecDesign(width=1.0),
    "variational, 2 numbers": CodecDesign(latent_dim=2, width=0.5),
    "variational, 4 numbers": CodecDesign(latent_dim=4, width=0.5),
    "variational, 16 numbers": CodecDesign(latent_dim=16, width=0.5),
}


def bench_codecs(steps: int, seed: int, json_path: Path | None) -> None:
    """Train codecs of all designs, and measure them beside the shipped one."""
    machine = print_machine()
    rows = []
    with console.status("Training codecs") as status:
        for row in compare_designs(DESIGNS, steps, seed):
            rows.append(row)
            status.update(f"Training codecs: {len(rows)} of {len(DESIGNS)} done")
    card, codec = load_codec()
    rows.append(measure_browsing("shipped", TFCodec(codec), card.training.get("steps", 0)))
    _tell(rows)
    if json_path is not None:
        write_json(json_path, {"machine": machine, "rows": [asdict(row) for row in rows]})


def _tell(rows: list[BrowsingRow]) -> None:
    heading = (
        "codec", "n", "steps", "TF", "thick", "faint", "way", "jump", "far", "none", "back", "near",
        "dim",
    )  # fmt: skip
    cells = [
        (
            row.name,
            str(row.latent_dim),
            str(row.steps),
            *(f"{error:.3f}" for error in row.layer_rmse.values()),
            f"{row.faint_rmse:.3f}",
            f"{row.detour:.2f}",
            f"{row.jump:.2f}",
            f"{row.plausible:.2f}",
            f"{row.nothing:.3f}",
            f"{row.returned:.2f}",
            f"{row.neighbours:.2f}",
            f"{row.dimension:.1f}",
        )
        for row in rows
    ]
    print_table("", heading, cells)
    console.print(
        "n: numbers of a code\n"
        "TF, thick, faint: RMSE of TFs, of layers of 16 voxels, of these where the TF is faint\n"
        "way, jump: length and largest step of the TFs along a straight line of codes\n"
        "far, none: random codes' distance from drawn TFs, and how many are empty\n"
        "back, near: change by decoding and encoding, and near TFs that are near as codes\n"
        "dim: effective dimension of the map's samples"
    )
