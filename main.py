"""Entry point of tfscope: opens the window by default; all other functions are subcommands."""

import os

# Must be set before torch is imported: with the window, VTK and torch in one process,
# OpenMP's busy-waiting threads would slow each other down by a factor of ten or more.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

if __name__ == "__main__":
    try:
        from app.cli import run

        raise SystemExit(run())
    except KeyboardInterrupt:
        # Ctrl-C during the imports, which take a second.
        raise SystemExit(130) from None
