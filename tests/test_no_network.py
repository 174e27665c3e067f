"""The window and the commands with connections forbidden and an empty home folder."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
MODEL = "resources/models/reacting_jet_paper"

FORBID = """
import os, socket

def forbidden(what):
    def record(*arguments, **options):
        with open(os.environ["TFSCOPE_CONNECTIONS"], "a") as file:
            print(what, arguments, file=file)
        raise OSError("connections are forbidden")
    return record

class Socket(socket.socket):
    def connect(self, address):
        if self.family != getattr(socket, "AF_UNIX", None):
            forbidden("connect")(address)
        return super().connect(address)

socket.socket = Socket
for name in ("getaddrinfo", "gethostbyname", "create_connection"):
    setattr(socket, name, forbidden(name))
"""

OURS = (
    Path(".cache/tfscope"),  # kernels and measurements
    Path(".cache/mesa_shader_cache"),  # of the OpenGL driver
    Path(".cache/mesa_shader_cache_db"),
    Path(".cache/fontconfig"),  # of the system's fonts
)
"""What may be found below the home folder; what a window keeps for its user comes with use."""


COMMANDS = {
    "info": f"info {MODEL}",
    # Kernels are compiled anew, as nothing is in the cache.
    "window": f"--model {MODEL} --screenshot OUT/window.png",
    "generator": f"render --renderer generator --model {MODEL} --size 32 --out OUT/image.png",
    "train": "train --preset draft --samples 8 --workers 1 --out OUT/run",
}
SLOW = [pytest.param(each.split(), marks=pytest.mark.slow) for each in COMMANDS.values()]


@pytest.mark.parametrize("command", [["--help"], *SLOW], ids=["help", *COMMANDS])
def test_nothing_is_contacted_and_nothing_is_left_behind(command, tmp_path):
    site, home, out = (tmp_path / name for name in ("site", "home", "out"))
    for folder in (site, home, out):
        folder.mkdir()
    (site / "sitecustomize.py").write_text(FORBID)
    connections = tmp_path / "connections"
    kept = {k: v for k, v in os.environ.items() if not k.startswith("XDG_")}
    process = subprocess.run(
        [sys.executable, "main.py", *(part.replace("OUT", str(out)) for part in command)],
        cwd=ROOT,
        env={
            **kept,
            "HOME": str(home),
            "PYTHONPATH": str(site),
            "TFSCOPE_CONNECTIONS": str(connections),
            # A continuous integration is spared by some libraries' reports.
            "CI": "",
        },
        capture_output=True,
        encoding="utf-8",
        timeout=300,
    )
    assert process.returncode == 0, process.stderr
    assert not connections.exists(), connections.read_text()
    found = [path.relative_to(home) for path in home.rglob("*") if path.is_file()]
    strays = [path for path in found if not any(path.is_relative_to(ours) for ours in OURS)]
    assert strays == []
