"""A fuzz job: mutated files of every format that tfscope reads, each read in a child process."""

import sys
from pathlib import Path

# The readers' tests have writers of most formats.
sys.path.insert(0, str(Path(__file__).parents[1] / "model" / "volume_files"))
