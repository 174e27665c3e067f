"""Installation of Python packages into the environment that runs this: by uv, or else by pip.

The Makefile runs this as a script before anything is installed, so it uses the standard library
only. Its arguments are those of ``pip install``. uv takes a third of pip's time; as it does not
read pip's settings, it is given those that say where packages come from.
"""

from __future__ import annotations

import ast
import os
import shutil
import subprocess
import sys
import tempfile

PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check")
UV = (sys.executable, "-m", "uv", "pip", "install", "--python", sys.executable, "--quiet")
BYTECODE = "--compile-bytecode"
"""As pip does: else each module would be compiled when it is first imported."""

SOURCES = {"index-url", "extra-index-url", "find-links", "no-index"}
"""pip's settings for the places of packages, which are options of uv by the same names."""


def pip_settings() -> dict[str, str]:
    """Return pip's settings by name, from its files and its variables, which count more."""
    listed = subprocess.run([*PIP, "config", "list"], capture_output=True, text=True, check=False)
    found: dict[str, str] = {}
    # Lines such as "global.find-links='/a /b'".
    for line in sorted(listed.stdout.splitlines(), key=lambda line: line.startswith(":env:")):
        name, is_setting, value = line.partition("=")
        if is_setting:
            found[name.rpartition(".")[2]] = str(ast.literal_eval(value))
    return found


def uv_options(settings: dict[str, str], has_nvidia: bool) -> list[str]:
    """Return uv's options for pip's settings.

    Where pip takes packages from PyPI, and there is no NVIDIA GPU, torch comes without CUDA, which
    is 4 GB less.
    """
    options = []
    for name in sorted(SOURCES & settings.keys()):
        if name == "no-index":
            options += (
                ["--no-index"] if settings[name].lower() in ("1", "true", "yes", "on") else []
            )
        else:
            options += [word for place in settings[name].split() for word in (f"--{name}", place)]
    for file in settings.get("constraint", "").split():
        options += ["--constraint", file]
    if SOURCES & settings.keys():
        # As pip does: the best version of all places.
        return [*options, "--index-strategy", "unsafe-best-match"]
    return options if has_nvidia else [*options, "--torch-backend", "cpu"]


def install_by_uv(arguments: list[str]) -> bool:
    """Install what the arguments name by uv, which stays nowhere; return whether that worked."""
    settings = pip_settings()
    with tempfile.TemporaryDirectory() as folder:
        getting = [*PIP, "install", "--quiet", "--target", folder, "uv"]
        if subprocess.run(getting, check=False).returncode:
            return False
        # An index that is named on purpose is the only one.
        options = [] if "--index-url" in arguments else uv_options(settings, has_nvidia())
        environment = {**os.environ, "PYTHONPATH": folder}
        if "cert" in settings:
            environment.setdefault("SSL_CERT_FILE", settings["cert"])
        command = [*UV, BYTECODE, *options, *arguments]
        return subprocess.run(command, env=environment, check=False).returncode == 0


def has_nvidia() -> bool:
    """Return whether this computer has the driver of an NVIDIA GPU."""
    return shutil.which("nvidia-smi") is not None


def main(arguments: list[str]) -> int:
    """Install what the arguments name; return the exit code."""
    if install_by_uv(arguments):
        return 0
    print("uv could not install the packages; pip does.", file=sys.stderr)
    return subprocess.run([*PIP, "install", "--quiet", *arguments], check=False).returncode


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
