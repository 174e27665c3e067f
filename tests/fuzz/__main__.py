"""``python -m tests.fuzz FORMAT ... --count N --seed S``: see :mod:`tests.fuzz.job`."""

import argparse
from pathlib import Path

from tests.fuzz.formats import FORMATS
from tests.fuzz.job import GOOD, fuzz


def main():
    """Fuzz some formats; return 1 if anything failed."""
    names = [name for name in FORMATS if name != "planted"]
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("format", nargs="+", choices=[*names, "all"])
    parser.add_argument("--count", type=int, default=2000, help="mutations of each format")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--jobs", type=int, default=2, help="child processes")
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"), help="for what fails")
    asked = parser.parse_args()
    failed = 0
    for name in names if "all" in asked.format else asked.format:
        found = fuzz(name, asked.count, asked.seed, asked.keep, asked.jobs)
        counts = ", ".join(f"{number} {what}" for what, number in sorted(found.counts.items()))
        print(f"{name}: {counts}", flush=True)
        failed += sum(number for what, number in found.counts.items() if what not in GOOD)
    if failed:
        print(f"What failed is in {asked.keep}.")
    return min(failed, 1)


if __name__ == "__main__":
    raise SystemExit(main())
