"""Help, a volume's description and wrong options need none of the heavy libraries."""

import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
VOLUME = ROOT / "resources" / "volumes" / "lidc_chest_256x256x133_int16.nrrd"
MODEL = ROOT / "resources" / "models" / "lidc_chest_paper"

# One process for all of them: the first of the commands that fail is the one to look at.
ANSWERS = """
import json, sys
from app.cli import run
heavy = ("torch", "openvino", "numba", "vtkmodules.vtkRenderingCore", "PySide6", "zarr", "skimage")
for arguments in json.loads(sys.argv[1]):
    print("arguments", arguments)
    print("code", run(arguments.split()), [name for name in heavy if sys.modules.get(name)])
"""

ANSWERED = ("--help", "train --help", f"info {VOLUME}")
REFUSED = {
    "": (
        f"info {VOLUME}x", "none.nrrd", "--volume none.nrrd", "--model none", "--tf none.json",
        "--view north", "--screenshot window.jpg", "render --out image.tiff",
        "evaluate --model none", "dataset --out notes.txt --count 5",
        "study baselines --out notes.txt",
    ),
    "render --out image.png": (
        "--view north", "--light up", "--wrong", "--volume notes.txt", "--tf none.json",
    ),
    "render --out image.png --renderer generator": (
        "--model none", f"--model {MODEL} --lighting direct", f"--model {MODEL} --light 0,0",
    ),
    "sensitivity --out field.npz": (
        "--region 1,2", "--out field.gif", "--volume none.nrrd",
        "--engine learned --lighting direct",
    ),
    "latent": ("--out map.json", "--out map.npz --near none.json", "--out map.npz --model none"),
    "train": (
        "--out run --movable-light", "--out run --set joint.batch_size=1 --preset huge",
        "--out run --resume", "--out run --dataset none", "--out run --start-from none",
    ),
    "dataset --out s.zarr --count 5": ("--workers 2 --scheduler tcp://a:1", "--movable-light"),
    f"evaluate --model {MODEL}": ("--json result.txt", "--dataset none"),
}  # fmt: skip
CASES = dict.fromkeys(ANSWERED, 0) | {
    f"{command} {each}".strip(): 2 for command, options in REFUSED.items() for each in options
}


def test_an_answer_needs_nothing_heavy(tmp_path):
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
