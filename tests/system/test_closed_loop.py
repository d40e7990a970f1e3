"""The whole loop through pixels: drawn, seen, placed, looked at, with the camera on the head.

Pictures are 60 ms late and come 30 times a second; the saccade's own latency is the rig's.
"""

from math import degrees
from typing import NamedTuple

import numpy as np
from fakes.runs import play, simulated
from numpy.typing import NDArray

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.gaze.angles import add, angle_between, rotate, rotation, scale, sub, unit, yaw_pitch
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Angles2, GazeState, Vec3
from gazerig.robot.loop.loop import Tick
from gazerig.robot.model.commands import Value
from gazerig.robot.model.face_geometry import PARTS_FACE_M
from gazerig.robot.run.models import rig_kinematics
from gazerig.sim_mock.cameras.frame_times import FrameParams
from gazerig.sim_mock.scenes.scene import ScenePerson


def true_part(person: ScenePerson, part: str | None) -> Vec3:
    """Return the true position of a part of a person's face; None: the tip of the nose."""
    if part is None:
        return person.p_world_face_m
    R = rotation((*person.face_yaw_pitch_rad, 0.0))
    return add(person.p_world_face_m, rotate(R, PARTS_FACE_M[part]))


def gaze_angles(pose: GazeState) -> Angles2:
    """Return yaw and pitch in the world of the mean of both measured lines of sight."""
    return yaw_pitch(_cyclopean(pose))


def gaze_error_rad(p_world_m: Vec3, pose: GazeState) -> float:
    """Return the angle between the measured gaze and a point, from the midpoint of the eyes."""
    return angle_between(_cyclopean(pose), sub(p_world_m, _middle(pose)))


def _cyclopean(pose: GazeState) -> Vec3:
    return unit(add(line_of_sight(pose, True), line_of_sight(pose, False)))


def _middle(pose: GazeState) -> Vec3:
    return scale(add(pose.p_world_eye_left_m, pose.p_world_eye_right_m), 0.5)


KEEPS_TO_THE_FACE: dict[str, Value] = {
    "gaze.looks_away": "none",
    "gaze.head.goal_model": "attention",
    "motion.enabled": False,
}
"""The gaze stays on the face, on which it is measured; the head turns nearly all the way."""
STEP_AT_S, ARRIVED_S = 2.0, 2.7
"""The step of steps-aside."""
CORRECTED_S = 0.2
FACE_DEG = 4.0
"""Half of a face's width at the distance of the scene, 1.1 m."""
Column = NDArray[np.float64]


class Seen(NamedTuple):
    """One run, a row a tick; degrees, seconds from the scene's beginning.

    off_deg: gaze off the true face part; gaze_deg: yaw of the gaze
    head_deg, facing_deg: the head's yaw, and that which would point it at the face
    jumps: in a saccade; captured_s: of the picture the tick went by
    """

    t_s: Column
    off_deg: Column
    gaze_deg: Column
    head_deg: Column
    facing_deg: Column
    jumps: Column
    captured_s: Column


def watched(scene: str, seconds: float) -> Seen:
    """Run a drawn scene and compare the measured gaze with the true place of the face part."""
    rig = apply_changes(load_rig("desk"), KEEPS_TO_THE_FACE)
    made = simulated(rig, scene, pixels=True)
    kinematics = rig_kinematics(rig)
    assert made.scene is not None
    people = made.scene.people
    rows: list[tuple[float, ...]] = []
    start_s: list[float] = []

    def watch(tick: Tick) -> None:
        start_s[:] = start_s or [tick.t_s]
        t_s, pose = tick.t_s - start_s[0], tick.pose
        person = people(t_s)[0]
        part = true_part(person, tick.target.part)
        rows.append(
            (
                t_s,
                degrees(gaze_error_rad(part, pose)),
                degrees(gaze_angles(pose)[0]),
                degrees(pose.head_rad[0]),
                degrees(kinematics.neck_angles_to(person.p_world_face_m)[0]),
                tick.gaze.phase == "saccade",
                tick.percept.captured_s - start_s[0] if tick.percept else -1.0,
            )
        )

    assert play(made, seconds, watch).stopped_by == "over"
    return Seen(*np.array(rows, float).T)


def test_a_face_that_steps_aside_is_looked_at_again_without_overshoot():
    """Its pictures are placed by the pose at their capture."""
    step = watched("steps-aside", ARRIVED_S + 1.4)
    before = step.facing_deg[step.t_s < STEP_AT_S].max()
    assert 37.0 < step.facing_deg[-1] - before < 41.0
    late_s = (step.t_s - step.captured_s)[step.captured_s > 0.0]
    assert late_s.min() >= FrameParams().latency_ms / 1e3 - 1e-6
    assert late_s.max() < 0.06 + 1.0 / 30.0 + 0.0101
    shown_s = step.t_s[step.captured_s >= ARRIVED_S][0]

    def on_target_s(off_deg: float) -> float:
        return float(step.t_s[(step.t_s >= ARRIVED_S) & (step.off_deg < off_deg)][0] - shown_s)

    # The eyes follow the step by catch-up saccades, some .2 s apart. The one that is under way as
    # the picture comes was planned while the face still moved: it lands on the face (seeds 0 to 9:
    # after .11 s at the latest), and one more puts it right on the part (.43 s).
    assert on_target_s(FACE_DEG) <= 0.3
    assert on_target_s(1.0) <= 0.25 + CORRECTED_S
    # and not by chance in passing: they stay, but for the saccades between its parts
    later = (step.t_s > shown_s + 0.25 + CORRECTED_S) & (step.jumps == 0.0)
    assert np.percentile(step.off_deg[later], 95) < 1.5
    after = step.t_s > STEP_AT_S
    assert step.head_deg[after].max() - step.facing_deg[-1] < 1.0
    assert step.head_deg.max() - step.head_deg[-1] < 1.5  # nor does it swing back, but for relief
    assert step.facing_deg[-1] - step.head_deg[-1] < 10.0  # it did turn
    rests = (step.t_s > ARRIVED_S + 1.0) & (step.jumps == 0.0)
    assert np.count_nonzero(rests) > 60
    assert np.percentile(step.off_deg[rests], 95) < 1.0
