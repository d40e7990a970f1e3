"""Random faults for simulated hours: python tests/judges/attack/soak.py --hours 2 [KIND ...]

Four servos of a kind move in simulated time while up to three faults at once strike their line,
their board or one of them. After each mix they must come back, or the bus names what a person has
to do. Each tick is judged as in tests/unit/drivers/buses/test_faults_in_motion.py.

wrong: fresh positions that the servo did not have during the read; of a board, whose positions are
    estimates from pulses without a checksum, they are only "off"
broken: goals or servos outside the limits, or too fast
ended: runs that the bus gave up
"""

import argparse
import random
import sys
import time
from collections import Counter
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

from bus_kinds import KINDS, Struck, WrongValueError, faults_of, in_process  # noqa: E402

from gazerig.drivers.errors import DriverError  # noqa: E402

EPISODES = 40
"""Mixes of faults until another machine is built."""

ALONE = ("collide {i}", "static 2")
"""No driver can tell two servos with one id apart, and noise may change any goal of others."""


def mix(kind: str, dice: random.Random) -> tuple[str, ...]:
    """Return up to three faults at once."""
    faults = [fault for fault in faults_of(kind) if fault not in ALONE[:1]]
    some = dice.sample(faults, dice.choice((1, 1, 2, 3)))
    return ALONE[1:] if ALONE[1] in some else tuple(some)


def soak(kind: str, hours: float, seed: int) -> Counter[str]:
    """Strike one machine after the other; return the counts."""
    counts, seen_s, nth = Counter[str](), 0.0, 0
    while seen_s < 3600.0 * hours:
        dice = random.Random(f"{seed} {kind} {nth}")
        struck = Struck(in_process(kind), dice.randrange(4))
        began_s, faults = struck.bench.now_s(), ("start",)
        try:
            for _ in range(EPISODES):
                faults = mix(kind, dice)
                counts["faults"] += len(faults)
                if not struck.strike(faults, dice.uniform(0.05, 2.0)):
                    counts["left, named"] += 1
                    break
                counts["came back"] += 1
        except (AssertionError, DriverError) as error:
            what = "broken" if isinstance(error, AssertionError) else "ended"
            if isinstance(error, WrongValueError):
                what = "off" if struck.bench.kind.board else "wrong"
            counts[what] += 1
            print(f"{kind} {seed} {nth}: {'; '.join(faults)}: {what}: {error}", flush=True)
        seen_s += struck.bench.now_s() - began_s
        nth += 1
    return counts


def main() -> None:
    """Soak one kind after the other."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("kinds", nargs="*", default=list(KINDS), help=", ".join(KINDS))
    parser.add_argument("--hours", type=float, default=2.0, help="simulated, of each kind")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    for kind in args.kinds:
        began_s = time.process_time()
        counts = soak(kind, args.hours, args.seed)
        print(f"== {kind}: {dict(counts)}, {time.process_time() - began_s:.0f} s of processor")


if __name__ == "__main__":
    main()
