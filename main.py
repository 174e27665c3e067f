"""tfscope's entry: the window by default, subcommands for everything it can do."""

import os

# Before torch is imported: with the window, VTK and torch in one process, OpenMP's
# spinning threads would slow each other down ten times and more.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")

if __name__ == "__main__":
    try:
        from app.cli import run

        raise SystemExit(run())
    except KeyboardInterrupt:
        # Ctrl-C while the imports, which take a second, were still running.
        raise SystemExit(130) from None
