"""A rule of one's own about who is looked at: what is farthest to the left.

Shows: gazerig.open(attention=...): any object with a method ``choose``.
Run:   python examples/own_attention.py            a simulated fight: hands come and go
       python examples/own_attention.py my.yaml 0  your own head, through webcam 0
"""

import sys

import gazerig
from gazerig.gaze.types import GazeState, Percept, Vec3


class LeftMost:
    """Looks at what is farthest to the left; with nothing in sight the rig's own rules go on."""

    def choose(self, percept: Percept | None, state: GazeState, t_s: float) -> Vec3 | None:
        """Return the point to look at, in the world; None: choose as ever."""
        if percept is None or not percept.bodies.ids:
            return None
        x, y, z = max(percept.bodies.p_world_m.tolist(), key=lambda p: p[1])
        return (x, y, z)


if __name__ == "__main__":
    mine, camera = (sys.argv[1], int(sys.argv[2])) if sys.argv[2:] else ("desk", None)
    scene = "boxing" if camera is None else None
    opened = gazerig.open(
        mine, mock=camera is None, scene=scene, camera=camera, attention=LeftMost()
    )
    with opened as head:
        for state in head.states(rate_hz=2.0, seconds=8.0):
            yaw, pitch = state.gaze.direction_deg
            print(f"looks at {state.gaze.target}, gaze {yaw:+.0f} {pitch:+.0f} deg")
