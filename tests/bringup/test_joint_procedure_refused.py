"""Which joints are not calibrated, and what is said of each; and a push rod."""

from collections.abc import Callable
from dataclasses import replace

import pytest
from joint_bench import EYE, GENTLY, STS, Bench

from gazerig.drivers.errors import BusLost, ServoFault, ServoMissing
from gazerig.features.bringup.calibration.endstop_search import STEPS_PER_DEG
from gazerig.features.bringup.calibration.linkage_calibration import HandPlacer, Steered, by_places
from gazerig.features.bringup.calibration.smart_servo_access import SingleJoint, SingleServo
from gazerig.robot.model.joint import JointParams


@pytest.mark.parametrize(
    ("joint", "register", "value", "says"),
    [
        (EYE, "homing_offset", 300, r"Homing Offset is 300 steps.*--clear-offset"),
        (EYE, "operating_mode", 4, r"operating_mode is 4, not 3: gazerig doctor --fix"),
        (EYE, "drive_mode", 1, r"drive_mode is 1, not 0"),
        (STS, "operating_mode", 1, r"operating_mode is 1, not 0: gazerig doctor --fix"),
        (STS, "phase", 0x1C, r"phase is 28, not 12: gazerig doctor --fix"),
    ],
)
def test_a_servo_set_up_in_another_way_is_refused(
    joint: JointParams, register: str, value: int, says: str
) -> None:
    bench = Bench(joint)
    bench.put(register, value)
    with pytest.raises(ServoMissing, match=says):
        bench.servo.check()


def test_a_wrong_model_is_named() -> None:
    bench = Bench(EYE)
    wrong = SingleServo("left_eye_pan", EYE.id, "xc330-m288", bench.port)
    with pytest.raises(ServoMissing, match="is xl330-m077, not xc330-m288"):
        wrong.check()


@pytest.mark.parametrize(
    ("joint", "fault", "says"),
    [
        (EYE, "overload {id}", "overload: .*gazerig reboot 1"),
        (STS, "overheat {id}", "overheating: let it cool"),
    ],
)
def test_a_servo_that_suffers_or_is_silent_is_named(
    joint: JointParams, fault: str, says: str
) -> None:
    bench = Bench(joint)
    bench.command(fault)
    with pytest.raises(ServoFault, match=says):
        bench.servo.check()
    bench.command("lose {id}")
    with pytest.raises(ServoMissing, match="does not answer"):
        bench.servo.check()
    with pytest.raises(BusLost, match="does not answer any more"):
        bench.joint.position()


def test_a_servo_that_answers_pings_alone_is_brought_to_speak() -> None:
    bench = Bench(EYE)
    bench.put("status_return_level", 0)
    assert bench.servo.check().limits == (0, 4095)


def test_a_joint_that_a_hand_took_over_the_seam_is_not_driven() -> None:
    bench = Bench(EYE, 4000)
    bench.chain.here(1).turn(200)
    with pytest.raises(ServoMissing, match="turned over the seam"):
        bench.joint.enable_torque(GENTLY)
    assert bench.get("torque_enable") == 0


def test_a_joint_that_is_left_alone_stops_by_itself() -> None:
    bench = Bench(EYE)
    bench.joint.enable_torque(GENTLY)
    bench.registers.write(1, "goal_position", 3000)
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    stopped_at = bench.get("present_position")
    assert bench.get("bus_watchdog") == 255
    bench.clock.sleep_until(bench.clock.now_s() + 1.0)
    assert bench.get("present_position") == pytest.approx(stopped_at, abs=3)
    assert stopped_at < 2100 + 0.5 * 2.0 * 15.0 * STEPS_PER_DEG


class Reader(Bench):
    """Who turns a joint by hand and says the angles read off, those proposed where it is None."""

    angles: list[float | None]

    def number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        self.said.append(question)
        live()
        said = self.angles.pop(0)
        return proposed if said is None else said

    def steer(self, question: str, servo: Steered) -> None:
        raise AssertionError("a servo that tells its place is turned by hand")


def test_a_push_rod_on_a_smart_servo_is_measured_by_hand() -> None:
    rod = replace(
        STS, min_deg=-20.0, max_deg=20.0, transmission_points=((-25.0, 1800.0), (25.0, 2400.0))
    )
    bench = Reader(STS)
    single = SingleJoint("left_eye_pan", rod, bench.servo, bench.clock, lambda: None)
    bench.script = [0, 250, -490, 120, 240]
    bench.angles = [22.0, -21.0, None, 10.0]
    made = by_places(HandPlacer(single, bench), bench, 1.0, 1)
    assert [round(at) for _, at in made.transmission_points] == [1860, 1980, 2100, 2220, 2350]
    assert [angle for angle, _ in made.transmission_points] == [-21.0, -10.5, 0.0, 10.0, 22.0]
    assert (made.min_deg, made.max_deg) == (-20.0, 21.0)
    assert any("turn left_eye_pan until it reads about step 1980" in line for line in bench.said)
