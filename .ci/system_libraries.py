"""Installation of shared libraries that Qt and VTK need and this machine lacks.

The Makefile runs this module as a script before anything else is installed, so it
uses the standard library only. Missing packages are installed with apt-get if the
user has the rights; otherwise the exact command is printed.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess
import sys
from pathlib import Path

MINIMUM_PYTHON = (3, 11)

LIBRARIES = {
    "libEGL.so.1": "libegl1",
    "libGL.so.1": "libgl1",
    "libX11-xcb.so.1": "libx11-xcb1",
    "libdbus-1.so.3": "libdbus-1-3",
    "libfontconfig.so.1": "libfontconfig1",
    "libglib-2.0.so.0": "libglib2.0-0",
    "libxcb-cursor.so.0": "libxcb-cursor0",
    "libxcb-icccm.so.4": "libxcb-icccm4",
    "libxcb-image.so.0": "libxcb-image0",
    "libxcb-keysyms.so.1": "libxcb-keysyms1",
    "libxcb-randr.so.0": "libxcb-randr0",
    "libxcb-render-util.so.0": "libxcb-render-util0",
    "libxcb-shape.so.0": "libxcb-shape0",
    "libxcb-xinerama.so.0": "libxcb-xinerama0",
    "libxcb-xkb.so.1": "libxcb-xkb1",
    "libxkbcommon-x11.so.0": "libxkbcommon-x11-0",
    "libxkbcommon.so.0": "libxkbcommon0",
}
"""Debian packages of the system libraries that the wheels need."""

FONTS = Path("/usr/share/fonts")
DRIVERS = ("libEGL_mesa.so.0", "libEGL_nvidia.so.0")


def missing_packages() -> list[str]:
    """Return the Debian packages of missing libraries, drivers and fonts."""
    packages = [package for library, package in LIBRARIES.items() if not _loads(library)]
    if not any(map(_loads, DRIVERS)):
        packages += ["libegl-mesa0", "libgl1-mesa-dri"]
    if not any(FONTS.rglob("*.[to]tf")):
        packages.append("fonts-dejavu-core")
    return sorted(packages)


def install(packages: list[str]) -> int:
    """Install packages with apt-get, or print the command; return an exit code."""
    command = ["apt-get", "install", "--yes", "--no-install-recommends", *packages]
    rights = _administrator()
    if shutil.which("apt-get") is None:
        print(f"Missing system packages (Debian names): {' '.join(packages)}", file=sys.stderr)
        return 1
    if rights is None:
        print(
            "System packages are missing; install them with:\n"
            f"  sudo apt-get update && sudo {' '.join(command)}",
            file=sys.stderr,
        )
        return 1
    print(f"Installing {' '.join(packages)}", flush=True)
    environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
    for part in (["apt-get", "update", "--quiet=2"], command):
        code = subprocess.run(
            [*rights, *part], env=environment, stdout=subprocess.DEVNULL, check=False
        ).returncode
        if code:
            print(f"'{' '.join([*rights, *part])}' failed; run it by hand.", file=sys.stderr)
            return code
    return 0


def check_python() -> int:
    """Check the interpreter for the virtual environment; return an exit code."""
    if sys.version_info < MINIMUM_PYTHON:
        needed = ".".join(map(str, MINIMUM_PYTHON))
        print(
            f"Python {sys.version.split()[0]} is too old; install Python {needed} or newer and "
            f"name it: make PYTHON=python{needed}",
            file=sys.stderr,
        )
        return 1
    try:
        import ensurepip  # noqa: F401
        import venv  # noqa: F401
    except ImportError:
        return install([f"python{sys.version_info.major}.{sys.version_info.minor}-venv"])
    return 0


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _administrator() -> list[str] | None:
    """Return the prefix to run a command as root, which may be empty; None if impossible."""
    if os.geteuid() == 0:
        return []
    sudo = shutil.which("sudo")
    if (
        sudo
        and subprocess.run([sudo, "-n", "true"], capture_output=True, check=False).returncode == 0
    ):
        return [sudo, "-n"]
    return None


def main(arguments: list[str]) -> int:
    """Check Python with ``--python``, otherwise install missing libraries on Linux."""
    if "--python" in arguments:
        return check_python()
    if sys.platform != "linux":
        return 0
    packages = missing_packages()
    return install(packages) if packages else 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
