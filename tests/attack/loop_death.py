"""The control loop killed, or stopped in its tracks: when do its servos let go? Prints a table.

    PYTHONPATH=tests python tests/attack/loop_death.py [repeats]

Every servo moves slowly to its end as its loop's process gets SIGKILL or SIGSTOP. "limp": from
then until no servo is under torque any more; "still": until the last one has stopped moving,
which is what a Dynamixel's own watchdog brings about: it goes on holding.
"""

import signal
import sys

from loop_deaths import driven

LOOK_S = 2.0
CASES = [
    ("dynamixel, own watchdog 200 ms", "dynamixel", False),
    ("dynamixel, guardian", "dynamixel", True),
    ("feetech, no guardian", "feetech", False),
    ("feetech, guardian", "feetech", True),
    ("maestro, no guardian", "maestro", False),
    ("maestro, guardian", "maestro", True),
    ("pca9685, no guardian", "pca9685", False),
    ("pca9685, guardian", "pca9685", True),
]


def main(repeats: int) -> None:
    """Strike every kind with both signals and print how long it took."""
    print(f"{'':40} {'signal':8} limp after (ms)        still after (ms)")
    for name, kind, guarded in CASES:
        for number in (signal.SIGKILL, signal.SIGSTOP):
            limp, still = [], []
            for _ in range(repeats):
                with driven(kind, guarded) as it:
                    limp.append(it.limp_after_s(it.strike(number), LOOK_S))
                if not guarded:
                    with driven(kind, guarded) as it:
                        still.append(it.still_after_s(it.strike(number), LOOK_S))
            print(f"{name:40} {number.name:8} {_told(limp):22} {_told(still)}", flush=True)


def _told(times: list[float | None]) -> str:
    if not times:
        return "-"
    found = [f"{t * 1e3:.0f}" for t in times if t is not None]
    return " ".join(found + ["never"] * (len(times) - len(found) > 0))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
