"""A head that shows moods and talks: expressions from the rig's table, a jaw by loudness.

Shows: ``express``, and ``level`` many times a second; joints of any name.
Run:   python examples/face.py          the shipped rig with a jaw and brows, emulated
       python examples/face.py my.yaml  your own, with expressions and a level "mouth"
"""

import sys

import numpy as np

import gazerig

LOUDNESS = np.abs(np.sin(np.linspace(0.0, 20.0, 100))) * np.hanning(100)
"""Of two seconds of speech, 50 values a second, 0..1: yours comes from a sound file."""


def feel(head: gazerig.Head) -> None:
    """Go through some moods, then speak."""
    for mood in ("happy", "surprised", "sad", "neutral"):
        head.express(mood)
        head.sleep(1.0)
        print(mood, "jaw", round(head.joints["jaw"].measured_deg, 1), "deg")
    head.speaking()
    widest_deg = 0.0
    for loudness in LOUDNESS:
        head.level("mouth", float(loudness))
        head.sleep(0.02)
        widest_deg = max(widest_deg, head.joints["jaw"].measured_deg)
    head.idle()
    print(f"speaking: jaw up to {widest_deg:.1f} deg")


if __name__ == "__main__":
    mine = sys.argv[1:]
    with gazerig.open(mine[0] if mine else "expressive", mock=not mine) as head:
        feel(head)
