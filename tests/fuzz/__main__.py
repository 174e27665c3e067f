"""``python -m tests.fuzz FORMAT ... --count N --seed S``: see :mod:`tests.fuzz.job`."""

import argparse
from pathlib import Path

from tests.fuzz.formats import FORMATS
from tests.fuzz.job import fuzz


def main():
    """Fuzz some formats; return 1 if anything failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("format", nargs="+", choices=[*FORMATS, "all"])
    parser.add_argument("--count", type=int, default=2000, help="mutations of each format")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, default=Path("build/fuzz"), help="for what fails")
    asked = parser.parse_args()
    failed = False
    for name in FORMATS if "all" in asked.format else asked.format:
        found = fuzz(name, FORMATS[name], asked.count, asked.seed, asked.keep)
        counts = ", ".join(f"{number} {what}" for what, number in sorted(found.counts.items()))
        print(f"{name}: {counts}", flush=True)
        failed |= bool(found.failures)
    if failed:
        print(f"What failed is in {asked.keep}.")
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())
