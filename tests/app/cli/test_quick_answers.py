"""Help, a volume's description and wrong options need none of the heavy libraries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
VOLUME = ROOT / "resources" / "volumes" / "lidc_chest_256x256x133_uint8.nrrd"

ANSWER = """
import sys
from app.cli import run
code = run(sys.argv[1:])
heavy = ("torch", "openvino", "numba", "vtkmodules.vtkRenderingCore", "PySide6")
print("code", code, [name for name in heavy if sys.modules.get(name)])
"""


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        ("--help", 0),
        ("train --help", 0),
        (f"info {VOLUME}", 0),
        ("render --out image.png --view north", 2),
        ("render --out image.png --light up", 2),
        ("render --out image.tiff", 2),
        ("render --out image.png --wrong", 2),
        ("sensitivity --out field.npz --region 1,2", 2),
        ("train --out run --movable-light", 2),
        ("train --out run --set joint.batch_size=1 --preset huge", 2),
        ("train --out run --minutes -1", 2),
        ("train --out run --window 3", 2),
        ("train --out run --job job.json --minutes 60", 2),
        ("train --out run --stop --resume", 2),
        ("train --out run --stop", 2),
        ("dataset --out s.zarr --count 5 --workers 2 --scheduler tcp://a:1", 2),
        ("evaluate --model m --json no/such/folder.json", 2),
    ],
)
def test_an_answer_needs_nothing_heavy(arguments: str, code: int, tmp_path: Path) -> None:
    process = subprocess.run(
        [sys.executable, "-c", ANSWER, *arguments.split()],
        capture_output=True,
        env={"PYTHONPATH": str(ROOT), "PATH": "", "HOME": str(tmp_path)},
        cwd=tmp_path,
        text=True,
    )
    assert process.stdout.splitlines()[-1] == f"code {code} []", process.stderr
