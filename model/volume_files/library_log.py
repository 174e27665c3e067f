"""What libraries log and raise while they read a file, collected instead of printed."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from model.errors import VolumeError, first_line
from model.volume_files.checks import damaged


@contextmanager
def log_of(*names: str) -> Iterator[list[str]]:
    """Collect what libraries log as a warning or an error, and keep their warnings quiet.

    Parameters
    ----------
    *names : str
        Of the libraries' loggers.
    """
    found = list[str]()
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: found.append(record.getMessage())  # type: ignore[method-assign]
    loggers = [logging.getLogger(name) for name in names]
    states = [(logger.propagate, logger.level) for logger in loggers]
    for logger in loggers:
        logger.propagate = False
        logger.addHandler(handler)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield found
    finally:
        for logger, (propagated, level) in zip(loggers, states, strict=True):
            logger.removeHandler(handler)
            logger.propagate = propagated
            logger.setLevel(level)


@contextmanager
def errors_of(path: Path, says: str, *loggers: str) -> Iterator[None]:
    """Take what a library raises for damage of a file, as "h5py says 'no such node'".

    Parameters
    ----------
    says : str
        Sentence with a place for the error's first line.
    *loggers : str
        See :func:`log_of`.
    """
    with log_of(*loggers):
        try:
            yield
        except (OSError, MemoryError, VolumeError):
            raise
        except Exception as error:
            # Libraries raise errors of many kinds.
            raise damaged(path, says.format(first_line(error))) from None
