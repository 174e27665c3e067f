"""The command line. Each command's dependencies are imported only when it runs."""

import os
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING, cast

from model.errors import TfscopeError, reason

if TYPE_CHECKING:
    from typer.core import TyperGroup

BAD_INPUT = 2

# Must be set before torch is imported: with the window, VTK and torch in one process,
# OpenMP's busy-waiting threads would slow each other down by a factor of ten or more.
os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
# Several NumPy threads wait for each other while other threads draw: seconds instead of 20 ms.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command given by arguments, by default those of the process; return its exit code.

    That is 2 with one line on standard error for bad input, 130 after Ctrl-C, and 1 if standard
    output is closed.
    """
    try:
        # The imports take a second; Ctrl-C must work during that time, too.
        from typer.main import get_command

        from app.cli.commands import application, with_options_for_files

        command = cast("TyperGroup", get_command(application))
        words = with_options_for_files(sys.argv[1:] if arguments is None else arguments, command)
        code = command(words, standalone_mode=False)
        # Flush here: an error at exit could not be reported.
        sys.stdout.flush()
    except TfscopeError as error:
        return _fail(f"{error} {_options(error.suggested)}")
    except KeyboardInterrupt:
        print("Interrupted.", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of standard output has ended; prevent a further error at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:
        return _fail(
            f"{error.filename or 'The output'}: it cannot be opened or written ({reason(error)}); "
            "choose another name or place."
        )
    except Exception as error:
        # typer's usage errors, whose class is private, have a method for their message.
        if not hasattr(error, "format_message"):
            if type(error).__name__ == "Abort":
                return 130
            raise
        message = error.format_message().replace("Value error, ", "").rstrip(".")
        return _fail(f"{message}. See --help.")
    return code if isinstance(code, int) else 0


def _options(suggested: dict[str, str]) -> str:
    """Format an error's suggested settings as options of the command line."""
    words = []
    for name, value in suggested.items():
        words += [f"--{name.replace('_', '-')}", *([value] if value else [])]
    return f"Try: {' '.join(words)}" if words else ""


def _fail(message: str) -> int:
    print(f"tfscope: {' '.join(message.split())}", file=sys.stderr)
    return BAD_INPUT
