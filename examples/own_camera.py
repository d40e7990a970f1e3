"""A camera of one's own: a sensor that says where a lamp is, so that there is no image at all.

Shows: gazerig.open(camera=...): any object that returns detections, or frames in which the rig's
detectors look (gazerig.drivers.camera.source.FrameSource). The rig says where the camera sits.
Run:   python examples/own_camera.py          an eye mechanism, its camera fixed
       python examples/own_camera.py my.yaml  your own head
"""

import sys
from math import sin

import gazerig
from gazerig.drivers.types import Detections, MovingBlob


class Lamp:
    """Sees a lamp that swings from side to side, thirty times a second."""

    def __init__(self) -> None:
        self._newest: Detections | None = None

    def open(self) -> None:
        """Begin to look."""

    def latest(self, now_s: float) -> Detections | None:
        """Return what was seen last; positions are in the camera's frame: right, down, ahead."""
        number = int(now_s * 30.0)
        if self._newest is None or number > self._newest.number:
            p_camera_m = (0.4 * sin(2.0 * now_s), 0.0, 1.2)
            lamp = MovingBlob(1, "lamp", p_camera_m, radius_m=0.05)
            self._newest = Detections(now_s, number, 640, 480, blobs=(lamp,))
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return what a person should know since the last call."""
        return ()

    def close(self) -> None:
        """Free the device."""


if __name__ == "__main__":
    mine = sys.argv[1:]
    with gazerig.open(mine[0] if mine else "maker", mock=not mine, camera=Lamp()) as head:
        for state in head.states(rate_hz=4.0, seconds=8.0):
            yaw, pitch = state.gaze.direction_deg
            print(f"looks at {state.gaze.target}, gaze {yaw:+.0f} {pitch:+.0f} deg")
