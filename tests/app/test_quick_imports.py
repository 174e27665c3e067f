"""Imports without PySide's look at the sources."""

import subprocess
import sys

SCRIPT = """
import linecache
import PySide6.QtCore
from app.quick_imports import leave_sources_unread
leave_sources_unread()
linecache.clearcache()
import scipy.ndimage
print(sum("scipy" in name for name in linecache.cache))
"""


def test_sources_of_modules_imported_afterwards_are_not_read():
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "0"
