"""SHA-256 of every byte sent to the servos, for all shipped rigs: pinned before code is moved.

Run by hand: ``python tests/golden/bus_bytes.py`` compares, ``--write`` pins what is sent now.
Simulated time and seeded random numbers make a run repeatable on one kind of machine; another
processor may round a sine otherwise, so what is pinned is not part of the test suite: that compares
two runs of one seed (test_run.py). Pin anew in the commit that moves anything otherwise on purpose.
"""

import argparse
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

PINNED = Path(__file__).with_suffix(".json")
RIGS = ("desk", "feetech", "maker")
SCENES = ("visitor", "boxing")
SEEDS = (0, 1)
SECONDS = 60
_MAIN = "from gazerig.robot.cli.entry_point import main; main()"


def digest(rig: str, scene: str, seed: int) -> str:
    """Return the digest of one run of the shipped program."""
    options = ("--mock", "--fast", "--no-page", "--scene", scene, "--summary", "-")
    numbers = ("--seconds", str(SECONDS), "--seed", str(seed))
    command = [sys.executable, "-c", _MAIN, "run", rig, *options, *numbers]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{' '.join(command)}: {done.stderr.strip()}")
    figures = json.loads(done.stdout[done.stdout.index("{") :])
    return str(figures["bus"]["tx_sha256"])


def main() -> int:
    """Compare with what is pinned, or pin; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="pin what is sent now")
    write = parser.parse_args().write
    runs = list(product(RIGS, SCENES, SEEDS))
    with ThreadPoolExecutor(2) as pool:
        found = dict(
            zip((f"{r} {s} seed {n}" for r, s, n in runs), pool.map(lambda a: digest(*a), runs),
                strict=True)
        )  # fmt: skip
    if write:
        PINNED.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
        print(f"{len(found)} digests pinned in {PINNED}")
        return 0
    pinned = json.loads(PINNED.read_text(encoding="utf-8"))
    other = [name for name in found if found[name] != pinned.get(name)]
    for name in found:
        print(f"{'differs' if name in other else 'same   '}  {name}")
    return 1 if other else 0


if __name__ == "__main__":
    sys.exit(main())
