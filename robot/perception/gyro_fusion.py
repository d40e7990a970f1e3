"""Camera orientation from the joints and the camera's own gyro.

The joints give the direction of the camera, but they measure neither a bump of the table nor motion
within play and between readings. The gyro measures every rotation, but drifts. A complementary
filter uses the gyro for fast rotations and follows the joints over about a second. Pure.
"""

from collections.abc import Callable
from math import acos, exp, inf, radians, sin

from gazerig.drivers.types import CameraTurn
from gazerig.gaze.angles import compose, norm, scale, transpose
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.perception.face_fit import rotation_by

_SETTLE_S = 1.0
"""Time in which a difference between gyro and joints falls to a third."""
# After a longer gap between frames only the joints give the orientation.
_GAP_S = 0.5
# A larger difference is not a bump: the joints are used, and if it recurs, the gyro is wrong.
_MOST_RAD = radians(15.0)
_MOST_TIMES, _WITHIN_S = 3, 30.0
_WITHOUT_S = 60.0


class GyroFusion:
    """Corrects the orientation from the joints, frame by frame.

    Args:
        report: called with a line when the gyro is found to be wrong.
    """

    def __init__(self, report: Callable[[str], None]) -> None:
        self._report = report
        self._before: tuple[float, CameraTurn, Mat3] | None = None
        self._too_far_s: list[float] = []
        self._without_until_s = -inf
        self._reported = False

    def reset(self) -> None:
        """Restart from the joints, after a change of the camera's mounting."""
        self._before = None

    def orientation(self, t_s: float, R_world_camera: Mat3, turn: CameraTurn | None) -> Mat3:
        """Return R_world_camera at the exposure of a frame.

        Args:
            t_s: time of the exposure.
            R_world_camera: orientation from the joints at that time.
            turn: rotation from the gyro; None without a gyro.
        """
        if turn is None or t_s < self._without_until_s:
            self._before = None
            return R_world_camera
        before, R = self._before, R_world_camera
        if before is not None and before[1].epoch == turn.epoch and 0.0 < t_s - before[0] < _GAP_S:
            R = self._advance(t_s, before, R_world_camera, turn)
        self._before = t_s, turn, R
        return R

    def _advance(
        self, t_s: float, before: tuple[float, CameraTurn, Mat3], R_joints: Mat3, turn: CameraTurn
    ) -> Mat3:
        """Return the last orientation, advanced by the gyro and pulled towards the joints'."""
        before_s, before_turn, R_before = before
        step = compose(transpose(before_turn.R_start_camera), turn.R_start_camera)
        R = compose(R_before, step)
        off = rotation_vector(compose(transpose(R), R_joints))
        if norm(off) > _MOST_RAD:
            self._disagree(t_s)
            return R_joints
        return compose(R, rotation_by(scale(off, 1.0 - exp((before_s - t_s) / _SETTLE_S))))

    def _disagree(self, t_s: float) -> None:
        """Count disagreements of gyro and joints; after several, ignore the gyro for a while.

        A base that is being carried also causes them, so the gyro is tried again.
        """
        self._too_far_s = [s for s in self._too_far_s if t_s - s < _WITHIN_S] + [t_s]
        if len(self._too_far_s) < _MOST_TIMES:
            return
        self._too_far_s, self._without_until_s = [], t_s + _WITHOUT_S
        if not self._reported:
            self._reported = True
            self._report(
                "the camera's gyro does not turn with the joints: the joints alone are used, "
                f"and the gyro is tried again every {_WITHOUT_S:g} s; unless the head was carried about, check "
                "oak.imu_rotation_deg and camera.mount, or set oak.gyro: false"
            )


def rotation_vector(R: Mat3) -> Vec3:
    """Return the axis of a rotation times its angle, which must be below pi."""
    (a, b, c), (d, e, f), (g, h, i) = R
    angle = acos(min(1.0, max(-1.0, 0.5 * (a + e + i - 1.0))))
    share = 0.5 if angle < 1e-6 else 0.5 * angle / sin(angle) if sin(angle) > 1e-6 else 0.0
    return share * (h - f), share * (c - g), share * (d - b)
