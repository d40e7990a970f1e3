"""Data that a killed study keeps: python tests/study/bench_study_kills.py --kills 100."""

import argparse
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from study_kills import killed


def main() -> None:
    """Print what became of the answers."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = killed(Path(folder), asked.kills, asked.seed)
    print(
        f"{found.kills} kills: {found.kept} answers were said to be kept, {found.lost} of them lost, "
        f"{found.twice} there twice; {found.participants} participants finished meanwhile"
    )


if __name__ == "__main__":
    main()
