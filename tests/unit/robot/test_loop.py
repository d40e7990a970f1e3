"""The loop's slots, the start without a jump, faults, parking; and the percept's place."""

import random
from collections.abc import Callable
from dataclasses import replace
from math import radians
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS
from fakes.runs import go, simulated

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import DetectedFace, Detections, Located, MovingBlob
from gazerig.gaze.angles import add, angle_between, rotate, rotate_back, rotation, sub
from gazerig.gaze.types import PARTS
from gazerig.robot.loop.loop import PARK_S, Tick
from gazerig.robot.model.clock import Clock, LoopParams, RealClock, SimulatedClock
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.robot.model.types import GuardResult
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker
from gazerig.robot.run.run import Run


def ticks(assembly: Run, seconds: float) -> list[Tick]:
    seen: list[Tick] = []
    assembly.robot.start(assembly.clock)
    go(assembly, seconds, seen.append)
    return seen


def test_every_goal_on_the_bus_is_inside_the_limits():
    rig = load_rig("desk")
    rig = replace(rig, loop=replace(rig.loop, rate_hz=100.0))
    run_of = simulated(rig, seed=3, bus="ideal")
    seen = ticks(run_of, 15.0)
    commands = np.array([tick.guard_result.command_rad for tick in seen])
    assert np.degrees(commands[0, [0, 6]]) == pytest.approx([6.0, -12.0], abs=0.2)
    speeds = np.diff(commands, axis=0) / 0.010
    # It starts slowly from where the joints are; a saccade would reach 500 deg/s.
    assert np.abs(speeds[:20]).max() <= radians(60.0) + 1e-6
    for i, name in enumerate(GAZE_JOINTS):
        limit = rig.joints[name].limit()
        assert commands[:, i].min() >= limit.low_rad and commands[:, i].max() <= limit.high_rad
        assert np.abs(speeds[:, i]).max() <= limit.speed_rad_s + 1e-6
        hardest = np.abs(np.diff(speeds[:, i])).max() / 0.010
        assert hardest <= limit.accel_rad_s2 * (1.0 + 1e-6)


def test_a_servo_fault_ends_the_loop_with_its_cause():
    assembly = simulated()
    assembly.robot.start(assembly.clock)
    chain = assembly.robot.body.bus._port.chain  # type: ignore[attr-defined]
    seen: list[Tick] = []

    def watch(tick: Tick) -> None:
        seen.append(tick)
        if len(seen) == 100:
            chain[7].overload()

    count = go(assembly, 5.0, watch)
    assert count.stopped_by == "fault: neck_yaw: overload"
    assert count.ticks <= 105


def test_parking_reaches_the_pose_and_torque_goes_off(monkeypatch):
    assembly = simulated(rate=100.0)
    ticks(assembly, 4.0)
    seen: list[Tick] = []
    made = assembly
    assert made.robot.park(made.park_rad, made.clock, made.loop, watch=seen.append)
    assert {tick.control_source.kind for tick in seen} == {"parking"} and len(seen) > 5
    bus: Any = assembly.robot.body.bus
    chain = bus._port.chain
    parked = assembly.robot.body.angles(list(chain.positions_steps()))
    assert np.degrees(parked) == pytest.approx(np.degrees(assembly.park_rad), abs=2.5)

    def fail() -> None:
        monkeypatch.undo()
        raise MemoryError  # then it is tried once more

    monkeypatch.setattr(bus, "disable_torque", fail)
    assembly.robot.stop()
    assert [chain[i].read(64, 1)[1] for i in range(1, 10)] == [b"\x00"] * 9


class SlowRobot:
    """Takes a given time, on a simulated clock."""

    def __init__(self, clock: SimulatedClock, cost_s: Callable[[int], float]) -> None:
        self.times: list[tuple[float, float]] = []
        self.clock, self.cost_s = clock, cost_s

    def tick(self, t_s: float, dt_s: float, watch: Callable[[Any], None]) -> Any:
        self.times.append((t_s, dt_s))
        self.clock.sleep_until(t_s + self.cost_s(len(self.times)))
        tick = SimpleNamespace(guard_result=GuardResult((), "ok", ()))
        watch(tick)
        return tick


def test_slots_are_absolute_and_overruns_are_skipped_not_caught_up():
    clock = SimulatedClock()
    robot = SlowRobot(clock, lambda n: 0.0231 if n == 10 else 0.001)
    stand_in: Any = SimpleNamespace(robot=robot, clock=clock, loop=LoopParams())
    count = go(stand_in, 1.0)
    slots = np.array([t for t, _ in robot.times]) / 0.005
    assert np.abs(slots - np.round(slots)).max() < 1e-6
    assert count.overruns == 4
    assert count.ticks == 199 - 4
    assert np.diff(slots).min() > 0.5
    assert robot.times[10][1] == pytest.approx(0.025)


def test_clocks():
    clock = SimulatedClock(5.0)
    clock.sleep_until(4.0)
    assert clock.now_s() == 5.0
    clock.sleep_until(6.5)
    assert clock.now_s() == 6.5
    real = RealClock()
    before = real.now_s()
    real.sleep_until(before + 0.02)
    assert real.now_s() >= before + 0.02


KINEMATICS = Kinematics(GeometryParams(60.0, 40.0, 50.0), GAZE_JOINTS, LIDS)
MOUNT = CameraMount(CameraParams())


def seen_from(head_yaw: float, t_s: float, number: int) -> Detections:
    """Show a stationary face at (1, 0.2, 0.2) from a head that is turned."""
    R, p = MOUNT.pose(*KINEMATICS.head_pose((head_yaw, 0.0, 0.0)))
    nose = np.array([1.0, 0.2, 0.2])
    towards = (np.array(p) - nose) / np.linalg.norm(np.array(p) - nose)
    left = np.cross([0.0, 0.0, 1.0], towards)
    left /= np.linalg.norm(left)
    axes = np.stack([towards, left, np.cross(towards, left)], axis=1)
    points = [rotate_back(R, sub(tuple(q), p)) for q in nose + LANDMARKS_FACE_M @ axes.T]
    px = project(np.array(points), intrinsics_of_view(radians(69.0), 640, 400))
    hand = MovingBlob(1, "hand", rotate_back(R, sub((0.8, -0.2, 0.1), p)), 0.07)
    face = DetectedFace((0, 0, 100, 100), px, 0.9)
    return Detections(t_s, number, 640, 400, (face,), (hand,))


def test_a_picture_is_placed_where_the_head_was_when_it_was_taken():
    perception = Perception(MOUNT, 69.0)
    poses = PoseHistory(KINEMATICS)
    errors, speeds = [], []
    for k in range(200):
        t = k * 0.005
        poses.remember(t, (radians(100.0 * t), 0.0, 0.0))  # the head turns with 100 deg/s
        if k % 7 == 0 and k >= 14:  # a picture that is 60 ms old
            taken = t - 0.06
            yaw = radians(100.0 * max(0.0, taken))
            percept = perception.see(seen_from(yaw, taken, k), poses)
            assert percept is not None and len(percept.faces) == 1
            face = percept.faces[0]
            errors.append(angle_between(face.p_world_m, (1.0, 0.2, 0.2)))
            speeds.append(np.linalg.norm(face.v_world_m_s))
            assert percept.bodies.kinds.count("hand") == 1
            if yaw > 0.45:  # the face leaves the camera's field
                break
    assert np.degrees(max(errors)) < 0.4  # without the history it would be 6
    assert max(speeds) < 0.1
    assert perception.frames == perception.frames_with_face == len(errors)


@pytest.mark.parametrize("turn_deg", [-30.0, 0.0, 30.0])
@pytest.mark.parametrize("aside_m", [-0.25, 0.25])
def test_e56_own_parts_move_and_turn_with_the_face(turn_deg, aside_m):
    own = {code: (-0.03, 0.02 * i - 0.07, 0.05 - 0.015 * i) for i, code in enumerate(PARTS)}
    perception = Perception(MOUNT, 69.0, own)
    nose, R = (1.0, aside_m, 0.25), rotation((radians(180.0 + turn_deg), 0.0, 0.0))
    detection = Located("face", nose, R, 0.1, 0.0, 0.9)
    (track,) = Tracker().step([detection], (0.0, 0.0, 0.2), 0.0)
    face = perception._face(track, (0.0, 0.0, 0.0))
    eye = (0.0, 0.0, 0.2)
    for code, seen in zip(PARTS, face.parts_world_m, strict=True):
        true = add(nose, rotate(R, own[code]))
        assert np.degrees(angle_between(sub(seen, eye), sub(true, eye))) <= 0.5
    if turn_deg:  # a calibration that knew the position alone would leave the turn out
        straight = rotation((radians(180.0), 0.0, 0.0))
        unturned = [sub(add(nose, rotate(straight, own[code])), eye) for code in PARTS]
        seen_from = [sub(part, eye) for part in face.parts_world_m]
        errors = [angle_between(a, b) for a, b in zip(seen_from, unturned, strict=True)]
        assert np.degrees(max(errors)) > 0.5


def test_the_same_picture_is_seen_once():
    perception = Perception(MOUNT, 69.0)
    poses = PoseHistory(KINEMATICS)
    poses.remember(0.0, (0.0, 0.0, 0.0))
    assert perception.see(None, poses) is None
    first = perception.see(seen_from(0.0, 0.0, 1), poses)
    assert perception.see(seen_from(0.0, 0.0, 1), poses) is first
    assert perception.frames == 1


# ---- Every shipped rig parks in time on a host whose ticks come late, without haste.


Missed = Callable[[int, random.Random], int]
HOSTS: dict[str, Missed] = {
    "one to three slots": lambda _, rng: rng.choice((1, 2, 3)),
    "three slots": lambda _n, _rng: 3,
    "never four times": lambda n, rng: rng.choice((1, 2, 3)) if n % 4 else 0,
}


class LateClock:
    """A simulated clock on which waits take some slots longer than requested."""

    def __init__(self, clock: Clock, missed: Missed, period_s: float) -> None:
        self._clock, self._missed, self._period_s = clock, missed, period_s
        self._rng, self._waits = random.Random(3), 0
        self.now_s = clock.now_s

    def sleep_until(self, t_s: float) -> None:
        late_s = self._missed(self._waits, self._rng) * self._period_s
        self._clock.sleep_until(max(t_s, self.now_s()) + late_s)
        self._waits += 1


@pytest.mark.parametrize("host", HOSTS)
@pytest.mark.parametrize("name", ["desk", "maker"])
def test_it_parks_in_time_on_a_host_that_is_late(name, host):
    rig = load_rig(name)
    made = simulated(rig)
    robot, period_s = made.robot, 1.0 / made.loop.rate_hz
    limits = robot.guard.limits
    robot.start(made.clock)
    go(made, 0.5)
    sent: list[tuple[float, tuple[float, ...]]] = []
    write = robot.body.write

    def watched(command_rad: tuple[float, ...]) -> None:
        sent.append((made.clock.now_s(), command_rad))
        write(command_rad)

    robot.body.write = watched  # type: ignore[method-assign]
    start_s, clock = made.clock.now_s(), LateClock(made.clock, HOSTS[host], period_s)
    assert robot.park(made.park_rad, clock, made.loop)
    assert made.clock.now_s() - start_s <= PARK_S
    robot.stop()
    made.close()

    slow = radians(rig.guard.soft_start_speed_deg_s)
    times, commands = map(np.array, zip(*sent, strict=True))
    gap_s = np.diff(times, prepend=times[0])
    for i, (limit, park_rad) in enumerate(zip(limits, made.park_rad, strict=True)):
        angles = commands[:, i]
        assert limit.low_rad - 1e-9 <= angles.min() and angles.max() <= limit.high_rad + 1e-9
        # The last degree is no slow passage: the joint has met its goal.
        far = 1 + np.flatnonzero(abs(angles[:-1] - park_rad) > radians(1.0))
        step = np.diff(angles, prepend=angles[0])
        for k in far[1:]:  # no farther than the slow speed reaches in the passed time
            last = abs(step[k - 1]) / gap_s[k - 1]
            assert abs(step[k]) / gap_s[k] <= max(slow, last) + 1e-6
