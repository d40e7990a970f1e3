"""Moving a rig slowly by command, over emulated servos in simulated time."""

from collections.abc import Iterator, Mapping
from math import degrees, nan, radians

import pytest
from desk import JOINTS
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.errors import SetupError
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.robot.app.gaze_models import gaze_parts
from gazerig.robot.bringup.look_at import ends_reached, look_at
from gazerig.robot.bringup.manual_control import JogParams, ManualControl, duration_s
from gazerig.robot.bringup.move_result import Step
from gazerig.robot.control.body import Body
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

RIG = load_rig("desk")
CROOKED = {"neck_yaw": -12.0, "left_eye_pan": 6.0, "neck_pitch": -8.0}


class Bench:
    """An emulated rig, a simulated clock and what was sent."""

    def __init__(self, rig: Rig = RIG, params: JogParams | None = None) -> None:
        self.rig, self.clock = rig, SimulatedClock()
        specs = [
            ServoSpec(j.id, j.model, round(j.steps(radians(CROOKED.get(name, 0.0)))))
            for name, j in ((name, rig.joints[name]) for name in JOINTS)
        ]
        self.chain = build_dynamixel(specs, self.clock.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.clock.sleep_until)
        setups = [rig.joints[name].setup(name) for name in JOINTS]
        bus = SmartServoBus(DYNAMIXEL, self.port, setups, rig.bus.dynamixel)
        guard = Guard(rig.guard, tuple(rig.joints[name].limit() for name in JOINTS), JOINTS)
        self.steps: list[Step] = []
        self.why: str | None = None
        self.control = ManualControl(
            Body(bus, rig.joints),
            guard,
            self.clock,
            params or JogParams(),
            lambda: self.why,
            self.note,
        )
        self.at: dict[float, str] = {}

    def note(self, step: Step) -> None:
        """Keep a step; carry out the fault commands that are due."""
        self.steps.append(step)
        for due_s in [due for due in self.at if due <= step.t_s]:
            self.port.faults.command(self.at.pop(due_s))

    def where(self) -> Mapping[str, float]:
        """Return the true joint angles in degrees."""
        steps = self.chain.positions_steps()
        joints = [self.rig.joints[name] for name in JOINTS]
        return {
            name: degrees(joint.angle_rad(step))
            for name, joint, step in zip(JOINTS, joints, steps, strict=True)
        }

    def torque(self) -> list[bool]:
        return [servo.torque for servo in self.chain.servos]


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    made.control.start()
    yield made
    made.control.stop()
    assert not any(made.torque())


def test_nothing_moves_at_the_start(bench: Bench) -> None:
    before = bench.where()
    assert all(bench.torque())
    held = bench.control.hold(1.0)
    assert held.arrived
    for name, angle in bench.where().items():
        assert angle == pytest.approx(before[name], abs=0.3)


def test_one_joint_moves_and_the_others_hold(bench: Bench) -> None:
    before = bench.where()
    moved = bench.control.jog("neck_yaw", 20.0)
    after = bench.where()
    assert moved.arrived
    assert moved.of("neck_yaw").error == pytest.approx(0.0, abs=2.0)
    assert after["neck_yaw"] == pytest.approx(20.0, abs=2.0)
    assert moved.of("neck_yaw").reasons == ()
    for name in JOINTS:
        if name != "neck_yaw":
            assert after[name] == pytest.approx(before[name], abs=0.5)


@settings(max_examples=5, deadline=None)
@given(
    joint=st.sampled_from(["left_eye_pan", "right_upper_lid", "neck_roll"]),
    angle=st.floats(-60.0, 60.0),
    speed=st.floats(5.0, 60.0),
)
def test_no_goal_is_faster_than_asked_nor_outside_the_range(
    joint: str, angle: float, speed: float
) -> None:
    bench = Bench(params=JogParams(speed_deg_s=speed))
    bench.control.start()
    moved = bench.control.pose({joint: angle})
    i, params = JOINTS.index(joint), RIG.joints[joint]
    low, high = radians(params.min_deg), radians(params.max_deg)
    sent = [(s.t_s, s.verdict.command_rad[i]) for s in bench.steps]
    for (t0, a), (t1, b) in zip(sent, sent[1:], strict=False):
        assert low - 1e-9 <= b <= high + 1e-9
        assert degrees(abs(b - a)) <= 1.1 * speed * (t1 - t0) + 1e-6
    assert moved.arrived == (params.min_deg - 2.0 <= angle <= params.max_deg + 2.0)
    bench.control.stop()


@given(far=st.floats(0.0, 3.0), speed=st.floats(0.5, 200.0), accel=st.floats(5.0, 5000.0))
def test_the_way_takes_long_enough_for_speed_and_acceleration(
    far: float, speed: float, accel: float
) -> None:
    takes = duration_s(far, JogParams(speed_deg_s=speed, accel_deg_s2=accel))
    assert 1.875 * degrees(far) / takes <= speed * (1.0 + 1e-9)
    assert 5.773 * degrees(far) / takes**2 <= accel * (1.0 + 1e-9)


def test_out_of_range_is_held_back_at_the_limit_and_says_so(bench: Bench) -> None:
    with pytest.raises(SetupError, match="50.0 deg is outside its range, -35..35 deg"):
        bench.control.jog("left_eye_pan", 50.0)
    moved = bench.control.pose({"left_eye_pan": 50.0})
    part = moved.of("left_eye_pan")
    assert not moved.arrived and moved.ended == "held back"
    assert part.wished == pytest.approx(50.0) and part.permitted == pytest.approx(35.0)
    assert part.reasons == ("out of range",)
    assert str(part).startswith("left_eye_pan: wished 50.0, is at 3")
    assert "permitted 35.0 (out of range)" in str(part)


def test_a_stuck_joint_is_named_and_not_pushed(bench: Bench) -> None:
    bench.port.faults.command("stick 7")
    before = bench.where()["neck_yaw"]
    moved = bench.control.jog("neck_yaw", 30.0)
    assert not moved.arrived
    assert any("not moving" in reason for reason in moved.of("neck_yaw").reasons)
    assert moved.of("neck_yaw").permitted == pytest.approx(before, abs=15.0)


def test_a_silent_servo_is_named(bench: Bench) -> None:
    bench.port.faults.command("lose 7")
    moved = bench.control.jog("neck_yaw", 30.0)
    assert not moved.arrived
    assert "stale joints" in moved.of("neck_yaw").reasons
    assert bench.where()["neck_yaw"] < 10.0


def test_a_latched_fault_ends_it(bench: Bench) -> None:
    bench.at[bench.clock.now_s() + 0.5] = "overload 7"
    moved = bench.control.jog("neck_yaw", 40.0)
    assert moved.ended == "limp" and moved.level == "limp"
    assert any("overload" in reason for reason in moved.of("neck_yaw").reasons)


def test_a_stop_ends_the_way_and_parking_goes_on(bench: Bench) -> None:
    bench.why = "SIGINT"
    moved = bench.control.jog("neck_yaw", 40.0)
    assert moved.ended == "SIGINT" and moved.seconds < 0.1
    parked = bench.control.park(RIG.park_deg)
    assert parked.arrived
    assert bench.where()["neck_pitch"] == pytest.approx(-12.0, abs=2.0)


def test_several_joints_arrive_together(bench: Bench) -> None:
    moved = bench.control.pose({"neck_yaw": 10.0, "left_eye_pan": -20.0, "neck_roll": 5.0})
    assert moved.arrived
    where = bench.where()
    assert where["neck_yaw"] == pytest.approx(10.0, abs=2.0)
    assert where["left_eye_pan"] == pytest.approx(-20.0, abs=2.0)
    halfway = bench.steps[len(bench.steps) // 3]
    i, j = JOINTS.index("left_eye_pan"), JOINTS.index("neck_yaw")
    assert halfway.wish_rad[i] < radians(6.0) and halfway.wish_rad[j] > radians(-12.0)


@pytest.mark.parametrize(
    ("joint", "angle", "says"),
    [("neck", 0.0, "no joint 'neck'; there is left_eye_pan"), ("neck_yaw", nan, "not an angle")],
)
def test_nonsense_is_refused_before_anything_moves(
    bench: Bench, joint: str, angle: float, says: str
) -> None:
    with pytest.raises(SetupError, match=says):
        bench.control.jog(joint, angle)
    assert bench.steps == []


# --- looking at a point


@pytest.mark.parametrize("point", [(1.0, 0.0, 0.3), (1.0, 0.4, 0.1), (0.4, -0.1, 0.2)])
def test_both_eyes_meet_a_point(bench: Bench, point: tuple[float, float, float]) -> None:
    kinematics, oculomotor = gaze_parts(RIG, 0)
    looked = look_at(bench.control, kinematics, oculomotor, point, 4.0)
    assert max(looked.left_error, looked.right_error) < 2.0
    assert looked.vergence == pytest.approx(looked.wished_vergence, abs=2.0)
    assert looked.moved.arrived


def test_a_point_behind_is_missed_and_the_error_says_so(bench: Bench) -> None:
    kinematics, oculomotor = gaze_parts(RIG, 0)
    looked = look_at(bench.control, kinematics, oculomotor, (-1.0, 0.1, 0.2), 4.0)
    assert min(looked.left_error, looked.right_error) > 20.0
    ends = ends_reached(RIG.joints, {"eye_pan": 34.0}, looked.moved)
    assert any("left_eye_pan is at the end of its range (-34..34 deg)" in line for line in ends)
    assert not any("tilt" in line for line in ends)


@pytest.mark.parametrize("point", [(nan, 0.0, 0.0), (0.038, 0.0, 0.125)])
def test_no_point_and_a_point_in_the_head_are_refused(
    bench: Bench, point: tuple[float, float, float]
) -> None:
    kinematics, oculomotor = gaze_parts(RIG, 0)
    with pytest.raises(SetupError, match=r"e\.g\. 1\.0 0\.2 0\.3"):
        look_at(bench.control, kinematics, oculomotor, point, 4.0)
