"""The head follows a point that runs round a circle one metre ahead.

Shows: looking at a point in the world, and what becomes of an order.
Run:   python examples/circle.py          emulated servos
       python examples/circle.py my.yaml  your own head
"""

import sys
from math import cos, pi, sin

import gazerig


def circle(head: gazerig.Head, points: int = 12) -> None:
    """Look at points on a circle of 20 cm, one after the other."""
    for k in range(points):
        angle = 2.0 * pi * k / points
        order = head.look_at(1.0, 0.2 * cos(angle), 0.2 + 0.2 * sin(angle), for_s=5.0)
        outcome = order.wait()
        yaw, pitch = head.gaze.direction_deg
        print(f"{outcome}: gaze {yaw:+5.1f} {pitch:+5.1f} deg {order.why}")
        head.sleep(0.3)


if __name__ == "__main__":
    mine = sys.argv[1:]
    with gazerig.open(mine[0] if mine else "desk", mock=not mine) as head:
        circle(head)
