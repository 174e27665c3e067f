import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
KERNEL = """
import sys
from model.compilation import compiled

@compiled
def add(a, b):
    total = 0.0
    for row in range(a):
        for column in range(b):
            total += row * column
    return total

sys.stdin.readline()
add(3, 4)
print(sum(add.stats.cache_misses.values()))
"""


@pytest.mark.slow
def test_of_two_processes_one_compiles_and_the_other_loads(tmp_path):
    script = tmp_path / "kernel.py"
    script.write_text(KERNEL)
    environment = os.environ | {"XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    both = [
        subprocess.Popen(
            [sys.executable, str(script)],
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(2)
    ]
    for process in both:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    assert sorted(process.communicate()[0].strip() for process in both) == ["0", "1"]
