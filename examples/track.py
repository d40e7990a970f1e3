"""Tracks: two that come with gazerig, and one of one's own in bow.yaml.

Shows: ``play``, what a track does to the joints, and how a rig gets further tracks.
Run:   python examples/track.py          emulated servos
       python examples/track.py my.yaml  your own head
"""

import sys
from pathlib import Path

import gazerig

POLITE = Path(__file__).with_name("polite.yaml")  # names bow.yaml


def perform(head: gazerig.Head) -> None:
    """Play some tracks; the eyes stay on a point meanwhile."""
    head.look_at(1.0, 0.1, 0.25)
    head.sleep(3.0)
    for track in ("nod", "shake", "bow"):
        order, lowest_deg = head.play(track), 90.0
        while order.outcome is None:
            head.sleep(0.02)
            lowest_deg = min(lowest_deg, head.joints["neck_pitch"].measured_deg)
        print(f"{order.reply.text()}: {order.outcome}; the head went to {lowest_deg:.0f} deg")


if __name__ == "__main__":
    mine = sys.argv[1:]
    rig = mine[0] if mine else "desk"
    with gazerig.open(rig, mock=not mine, character=str(POLITE)) as head:
        perform(head)
