"""What libraries log while they read a file, collected instead of printed."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager


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
