"""Two heads in one program: wherever the first looks, the second looks too.

Shows: several heads at once, and a gaze handed from one to the other.
Run:   python examples/two_heads.py                 both emulated
       python examples/two_heads.py my.yaml my2.yaml  both real, each on a port of its own
"""

import sys

import gazerig

BETWEEN_M = 0.5
"""The second head stands so far to the left of the first, looking the same way."""


def follow(first: gazerig.Head, second: gazerig.Head, seconds: float) -> None:
    """Let the second head look at what the first one looks at."""
    for state in first.states(rate_hz=5.0, seconds=seconds):
        x, y, z = state.gaze.point_m
        second.look_at(x, y - BETWEEN_M, z)
        second.sleep(0.2)
        yaws = [round(head.gaze.direction_deg[0]) for head in (first, second)]
        print(f"{state.gaze.target}: yaw {yaws} deg")


if __name__ == "__main__":
    names = sys.argv[1:] or ["desk", "feetech"]
    one, other = (gazerig.open(name, mock=not sys.argv[1:]) for name in names)
    with one as first, other as second:
        follow(first, second, seconds=8.0)
