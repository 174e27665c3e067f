"""Help, a volume's description and wrong options need none of the heavy libraries."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
VOLUME = ROOT / "resources" / "volumes" / "lidc_chest_256x256x133_uint8.nrrd"
MODEL = ROOT / "resources" / "models" / "lidc_chest_paper"

# One process for all of them, as each would take half a second: what one command imports is there
# for all that follow, so that the first of the commands that fail is the one to look at.
ANSWERS = """
import json, sys
from app.cli import run
heavy = ("torch", "openvino", "numba", "vtkmodules.vtkRenderingCore", "PySide6", "zarr", "skimage")
for arguments in json.loads(sys.argv[1]):
    print("arguments", arguments)
    print("code", run(arguments.split()), [name for name in heavy if sys.modules.get(name)])
"""

CASES = {
    "--help": 0,
    "train --help": 0,
    f"info {VOLUME}": 0,
    f"info {VOLUME}x": 2,
    "none.nrrd": 2,
    "--volume none.nrrd": 2,
    "--model none": 2,
    "--tf none.json": 2,
    "--view north": 2,
    "--screenshot window.jpg": 2,
    "render --out image.png --view north": 2,
    "render --out image.png --light up": 2,
    "render --out image.png --lighting none --light 0,0": 2,
    "render --out image.png --crop 0,2,0,1,0,1": 2,
    "render --out image.png --size 5": 2,
    "render --out image.tiff": 2,
    "render --out image.png --wrong": 2,
    "render --out image.png --volume none.nrrd": 2,
    "render --out image.png --volume notes.txt": 2,
    "render --out image.png --tf none.json": 2,
    "render --out image.png --renderer generator --model none": 2,
    f"render --out image.png --renderer generator --model {MODEL} --lighting direct": 2,
    f"render --out image.png --renderer generator --model {MODEL} --light 0,0": 2,
    "sensitivity --out field.npz --region 1,2": 2,
    "sensitivity --out field.gif": 2,
    "sensitivity --out field.npz --volume none.nrrd": 2,
    "sensitivity --out field.npz --engine learned --lighting direct": 2,
    "latent --out map.gif": 2,
    "latent --out map.npz --at 1": 2,
    "latent --out map.npz --near none.json": 2,
    "latent --out map.npz --model none": 2,
    "latent --out map.json": 2,
    "train --out run --movable-light": 2,
    "train --out run --set joint.batch_size=1 --preset huge": 2,
    "train --out run --minutes -1": 2,
    "train --out run --window 3": 2,
    "train --out run --resume": 2,
    "train --out run --volume none.nrrd": 2,
    "train --out run --dataset none": 2,
    "train --out run --start-from none": 2,
    "train --out notes.txt": 2,
    "dataset --out s.zarr --count 5 --workers 2 --scheduler tcp://a:1": 2,
    "dataset --out s.zarr --count 5 --movable-light": 2,
    "dataset --out notes.txt --count 5": 2,
    f"evaluate --model {MODEL} --json result.txt": 2,
    f"evaluate --model {MODEL} --dataset none": 2,
    "evaluate --model none": 2,
    "study baselines --out notes.txt": 2,
}


def test_an_answer_needs_nothing_heavy(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("")
    process = subprocess.run(
        [sys.executable, "-c", ANSWERS, json.dumps([*CASES])],
        capture_output=True,
        env={"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)},
        cwd=tmp_path,
        encoding="utf-8",
    )
    printed = [line for line in process.stdout.splitlines() if line.startswith(("arg", "code"))]
    expected = [
        line
        for arguments, code in CASES.items()
        for line in (f"arguments {arguments}", f"code {code} []")
    ]
    assert printed == expected, process.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]
