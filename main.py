"""Entry point of tfscope: opens the window by default; all other functions are subcommands."""

if __name__ == "__main__":
    from app.cli import run

    raise SystemExit(run())
