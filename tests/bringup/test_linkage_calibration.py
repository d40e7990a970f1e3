"""A joint behind a push rod: places marked by eye over an emulated board, and their linkage."""

from collections.abc import Callable
from dataclasses import replace
from math import radians
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import BusLost, ServoMissing
from gazerig.drivers.maestro.commands import MaestroCodec
from gazerig.features.bringup.calibration.hobby_access import SPEED_US_S, HobbyServoHandle
from gazerig.features.bringup.calibration.joint_calibration import CalibrationRefused, changes
from gazerig.features.bringup.calibration.linkage_calibration import (
    LEAD_US,
    HobbyMarker,
    JoggableJoint,
    angle_now,
    calibrate_by_marks,
    fit_linkage,
    likely_angle,
    spread_between,
)
from gazerig.features.bringup.calibration.smart_servo_access import CalibrationStopped
from gazerig.robot.app.emulation import emulated_lines
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.joint import JointParams
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort

MAKER = load_rig("maker")
PAN, LID = MAKER.joints["eyes_pan"], MAKER.joints["left_lower_lid"]


@given(
    left=st.floats(6.0, 60.0),
    right=st.floats(6.0, 60.0),
    zero=st.integers(1200, 1800),
    reach=st.integers(100, 600),
    rising=st.booleans(),
    margin=st.floats(0.0, 3.0),
)
def test_the_range_lies_inside_what_was_marked(
    left: float, right: float, zero: int, reach: int, rising: bool, margin: float
) -> None:
    way = reach if rising else -reach
    marked = [(0.0, float(zero)), (left, float(zero + way)), (-right, float(zero - way))]
    made = fit_linkage("eyes_pan", marked, PAN, margin)
    assert [at for _, at in made.transmission_points] == sorted(
        (at for _, at in marked), reverse=not rising
    )
    assert -right - 0.051 + margin <= made.min_deg < 0.0 < made.max_deg <= left + 0.051 - margin
    assert made.max_deg >= left - margin - 0.151 and made.min_deg <= margin - right + 0.151
    joint = replace(PAN, **made._asdict())
    assert joint.steps(0.0) == zero * 4
    assert joint.made().rising == rising


def test_a_lid_ends_where_it_was_marked_and_its_keys_are_its_own() -> None:
    made = fit_linkage("left_lower_lid", [(20.0, 1250.0), (-9.0, 1600.0), (5.0, 1450.0)], LID, 2.0)
    assert (made.min_deg, made.max_deg) == (-9.0, 20.0)
    wanted = changes("left_lower_lid", LID, made, {"left_lower_lid": -12.0})
    assert wanted == {
        "joints.left_lower_lid.transmission_points": ((-9, 1600), (5, 1450), (20, 1250)),
        "joints.left_lower_lid.min_deg": -9.0,
        "joints.left_lower_lid.max_deg": 20.0,
        "lid_joints.left_lower_shut_deg": -9.0,
        "lid_joints.left_lower_open_deg": 20.0,
        "park_deg.left_lower_lid": -9.0,
    }


@pytest.mark.parametrize(
    ("name", "marked", "says"),
    [
        ("eyes_pan", [(0.0, 1500.0), (1.5, 1600.0), (-20.0, 1300.0)], "0 deg must be within"),
        ("left_lower_lid", [(20.0, 1250.0), (3.0, 1600.0)], "call half open 0"),
        ("eyes_pan", [(0.0, 1500.0), (4.0, 1600.0), (-4.0, 1300.0)], "only 4.0 deg"),
        ("eyes_pan", [(0.0, 1500.0), (20.0, 1450.0), (-20.0, 1300.0)], "all rise or all fall"),
        ("eyes_pan", [(0.0, 1500.0), (0.0, 1700.0), (-20.0, 1300.0)], "must be within|must rise"),
        ("eyes_pan", [(0.0, 1500.0), (20.0, 2900.0), (-20.0, 1300.0)], "outside the servo's"),
    ],
)
def test_what_makes_no_linkage_is_refused_with_the_rule(
    name: str, marked: list[tuple[float, float]], says: str
) -> None:
    with pytest.raises(CalibrationRefused, match=says):
        fit_linkage(name, marked, MAKER.joints[name], 2.0)


def test_proposals_keep_the_shape_of_the_curve_and_meet_the_marks() -> None:
    assert angle_now(PAN, 1500.0) == 0.0 and angle_now(PAN, 1776.0) == 20.0
    one, other = (0.0, 1500.0), (40.0, 1776.0)
    assert likely_angle(PAN, 1500.0, one, other) == 0.0
    assert likely_angle(PAN, 1776.0, one, other) == 40.0
    # What was 10 deg of 20 is 20 of 40 now.
    assert likely_angle(PAN, 1634.0, one, other) == pytest.approx(20.0, abs=0.1)
    assert likely_angle(PAN, 1634.0, (0.0, 1776.0), (-40.0, 1500.0)) == pytest.approx(-20, abs=0.1)


def test_places_between_are_evenly_spread() -> None:
    assert spread_between(1500.0, 1800.0, 2) == [1600.0, 1700.0]
    assert spread_between(1800.0, 1500.0, 0) == []


def test_a_smart_servo_behind_a_push_rod_is_measured_in_steps() -> None:
    smart = JointParams(
        1, "sts3215", -20.0, 20.0, 300.0, 20000.0, transmission_points=((-25, 1800), (25, 2300))
    )
    made = fit_linkage("eyes_pan", [(0.0, 2050.0), (22.0, 2300.0), (-21.0, 1790.0)], smart, 1.0)
    joint = replace(smart, **made._asdict())
    assert joint.steps(radians(-21.0)) == pytest.approx(1790.0)
    assert (made.min_deg, made.max_deg) == (-20.0, 21.0)


# --- measured by eye

BOARD = MAKER.bus.maestro


class Bench:
    """The maker's board, one of its servos, and a person with a script.

    Answers: "+40" and "1480" steer, "" is Enter where it is steered and the proposed number
    where one is asked for.
    """

    def __init__(self, name: str, *answers: str, pulses: tuple[float, float] = (500, 2500)) -> None:
        self.clock = SimulatedClock()
        self.board = build(emulated_lines(MAKER)[""], self.clock.now_s)
        self.sent: list[bytes] = []
        self.port = InProcessPort(self.board, self.sent.append, sleep_until=self.clock.sleep_until)
        self.why: str | None = None
        self.answers = list(answers)
        self.said: list[str] = []
        self.channel = MAKER.joints[name].id
        self.hobby = HobbyServoHandle(
            name, MAKER.joints[name], self.port, BOARD, self.clock, lambda: self.why, pulses
        )
        self.placer = HobbyMarker(self.hobby, self)

    def place_us(self) -> float:
        """Return where the shaft truly is."""
        return cast(Any, self.board).here(self.channel).place_steps / 4

    def pulse(self) -> int:
        """Return the pulse that the board gives now."""
        report = cast(Any, self.board).faults.reports()[self.channel]
        position = report["position"]
        assert isinstance(position, int)
        return position

    def measure(self, margin: float = 2.0, more: int = 0):
        try:
            return calibrate_by_marks(self.placer, self, margin, more)
        finally:
            self.hobby.disable()

    # gazerig.features.bringup.calibration.linkage_calibration.Jogger

    def tell(self, line: str) -> None:
        self.said.append(line)

    def wait(self, question: str, live: Callable[[], str]) -> None:
        raise AssertionError(question)

    def agrees(self, question: str, live: Callable[[], str]) -> bool:
        raise AssertionError(question)

    def steer(self, question: str, servo: JoggableJoint) -> None:
        self.said.append(question)
        while answer := self._next():
            (servo.by if answer[0] in "+-" else servo.to)(float(answer))
            servo.live()

    def number(self, question: str, proposed: float, live: Callable[[], str]) -> float:
        self.said.append(question)
        live()
        answer = self._next()
        return float(answer) if answer else proposed

    def _next(self) -> str:
        if not self.answers:
            raise CalibrationStopped("stopped by you")
        return self.answers.pop(0)


def test_eyes_are_measured_and_their_pulses_end() -> None:
    bench = Bench("eyes_pan", "", "", "1800", "", "25", "1210", "", "-24")
    made = bench.measure()
    assert made.transmission_points == ((-24.0, 1210.0), (0.0, 1500.0), (25.0, 1800.0))
    assert (made.min_deg, made.max_deg) == (-22.0, 23.0)
    assert bench.pulse() == 0 and bench.place_us() == pytest.approx(1500.0, abs=6.0)
    assert "move eyes_pan to its LEFT end, as far as it goes freely, then press Enter" in bench.said
    assert any("Keep your fingers out" in line for line in bench.said)
    assert any("cut the servo power" in line for line in bench.said)


def test_places_between_are_gone_to_and_asked_for() -> None:
    bench = Bench("eyes_tilt", "", "", "1210", "", "", "1790", "", "", "-13.5", "", "")
    made = bench.measure(more=1)
    assert [at for _, at in made.transmission_points] == [1790.0, 1650.0, 1510.0, 1360.0, 1210.0]
    assert made.transmission_points[1][0] == -13.5 and made.transmission_points[2] == (0.0, 1510.0)
    # What is proposed is what the file says of that pulse.
    assert made.transmission_points[-1][0] == pytest.approx(22.4, abs=0.2)


def test_a_lid_is_left_shut_so_that_the_other_can_meet_it() -> None:
    bench = Bench("left_lower_lid", "", "1300", "", "20", "1600", "", "-9.5")
    made = bench.measure()
    assert (made.min_deg, made.max_deg) == (-9.5, 20.0)
    assert bench.place_us() == pytest.approx(1600.0, abs=6.0) and bench.pulse() == 0
    assert any("SHUT: where it meets the upper lid" in line for line in bench.said)


def test_a_channel_that_gives_pulses_does_not_jump() -> None:
    bench = Bench("eyes_pan", "", "1550", "", "", "1450", "", "")
    bench.port.setBaudRate(115_200)
    bench.port.write(MaestroCodec(crc=BOARD.crc).target(0, 1534 * 4))
    bench.clock.sleep_until(1.0)
    before = bench.place_us()
    bench.hobby.open()
    assert bench.hobby.begin(2000.0) == 1534.0
    bench.clock.sleep_until(2.0)
    assert bench.place_us() == pytest.approx(before, abs=1.0)


def test_it_moves_slowly_and_never_outside_what_was_asked() -> None:
    bench = Bench("eyes_pan", pulses=(1400.0, 1700.0))
    bench.hobby.open()
    bench.hobby.begin(1500.0)
    bench.clock.sleep_until(bench.clock.now_s() + 0.5)
    assert bench.hobby.aim(2400.0) == 1700.0
    start_s, start_us = bench.clock.now_s(), bench.place_us()
    while not bench.hobby.look():
        way_us = bench.place_us() - start_us
        assert way_us <= SPEED_US_S * (bench.clock.now_s() - start_s + 0.05)
    assert bench.hobby.arrive() == 1700.0
    assert bench.place_us() == pytest.approx(1700.0, abs=6.0)


def test_a_key_that_is_held_down_runs_never_far_ahead() -> None:
    bench = Bench("eyes_pan")
    bench.hobby.open()
    bench.hobby.begin(1500.0)
    for _ in range(40):
        bench.placer.nudge(50.0)
        bench.placer.live()
        assert bench.hobby.place_us - bench.hobby.pulse_us <= LEAD_US + SPEED_US_S * 0.05
    let_go_us = bench.hobby.pulse_us
    assert bench.hobby.arrive() - let_go_us <= LEAD_US + 1.0


def test_the_board_s_own_range_is_where_it_ends_and_is_named() -> None:
    bench = Bench("eyes_pan")
    narrow = emulated_lines(MAKER)[""]
    servos = tuple(
        one._replace(max_steps=1700 * 4) if one.channel == 0 else one
        for one in cast(tuple[Any, ...], narrow.servos)
    )
    bench.board = build(replace(narrow, servos=servos), bench.clock.now_s)  # type: ignore[arg-type]
    bench.port = InProcessPort(bench.board, sleep_until=bench.clock.sleep_until)
    bench.hobby = HobbyServoHandle(
        "eyes_pan", MAKER.joints["eyes_pan"], bench.port, BOARD, bench.clock,
        lambda: None, (500.0, 2500.0),
    )  # fmt: skip
    bench.hobby.open()
    bench.hobby.begin(1600.0)
    bench.hobby.aim(1900.0)
    assert bench.hobby.arrive() == pytest.approx(1700.0, abs=1.0)
    assert any("widen the range of its channel" in line for line in bench.hobby.events())
    bench.hobby.aim(1650.0)
    assert bench.hobby.arrive() == 1650.0


@pytest.mark.parametrize("why", ["SIGINT", "q"])
def test_whoever_ends_it_gets_a_limp_servo(why: str) -> None:
    bench = Bench("eyes_pan", "", "1700")
    bench.answers += [""] if why == "SIGINT" else []
    if why == "SIGINT":
        bench.tell = lambda line: setattr(bench, "why", why)  # type: ignore[method-assign]
    with pytest.raises(CalibrationStopped):
        bench.measure()
    assert bench.pulse() == 0


def test_marks_that_go_back_are_refused_and_it_is_let_go() -> None:
    bench = Bench("eyes_pan", "", "", "1700", "", "20", "1600", "", "-20")
    with pytest.raises(CalibrationRefused, match="all rise or all fall"):
        bench.measure()
    assert bench.pulse() == 0


def test_a_board_that_falls_silent_or_is_not_there_is_named() -> None:
    bench = Bench("eyes_pan")
    bench.hobby.open()
    bench.hobby.begin(1500.0)
    bench.port.faults.command("lose all")
    with pytest.raises(BusLost, match="does not answer"):
        bench.hobby.arrive()
    silent = Bench("eyes_pan")
    silent.port.faults.command("lose all")
    with pytest.raises(ServoMissing):
        silent.hobby.open()
