"""Heat, load, voltage, torque and latched faults: slower first, then still, then limp."""

from math import nan, radians
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from guarded_desk import DT, NECK, ZERO, guarding, joints_at

from gazerig.robot.model.types import GuardResult

JOINT = 6
NAME = GAZE_JOINTS[JOINT]


class World:
    """Joints that follow their commands one tick later, with given feedback of servos."""

    def __init__(self) -> None:
        self.guard = guarding()
        self.t_s = 0.0
        self.position = [0.0] * 9
        self.path = [0.0]

    def tick(self, desired: float, *, stray: float | None = None, **said: object) -> GuardResult:
        """One tick with the joint commanded to ``desired``; stray: its true place."""
        self.t_s += DT
        at = list(self.position)
        if stray is not None:
            at[JOINT] = stray
        columns: dict[str, Any] = {
            name: tuple(one if k == JOINT else self._usual(name) for k in range(9))
            for name, one in said.items()
        }
        wishes = tuple(desired if k == JOINT else 0.0 for k in range(9))
        verdict = self.guard.check(wishes, joints_at(at, self.t_s, **columns), 0.0, self.t_s)
        self.position = list(verdict.command_rad)
        self.path.append(verdict.command_rad[JOINT])
        return verdict

    @staticmethod
    def _usual(name: str) -> object:
        usual = {"torque": True, "fault": "", "load": 0.0, "temperature_c": 40.0}
        return {**usual, "voltage_v": 5.0, "rearmed": False}[name]

    def speeds(self) -> np.ndarray:
        return np.diff(self.path) / DT


def reason(verdict: GuardResult) -> str:
    return verdict.applied(NAME).reason


@pytest.fixture
def world() -> World:
    return World()


@pytest.mark.parametrize("celsius", np.linspace(50.0, 75.0, 101).tolist())
def test_heat_slows_a_joint_down_before_it_stops_it(world: World, celsius: float) -> None:
    verdicts = [world.tick(0.5, temperature_c=celsius) for _ in range(60)]
    share = min(max(1.0 - 0.8 * (celsius - 55.0) / 10.0, 0.0), 1.0)
    speeds = world.speeds()
    if celsius >= 65.0:
        assert (verdicts[-1].level, reason(verdicts[-1])) == ("hold", "hot")
        assert world.path[-1] == 0.0
        return
    assert speeds.max() == pytest.approx(share * NECK.speed_rad_s, rel=0.03)
    assert speeds.max() <= share * NECK.speed_rad_s + 1e-9
    assert np.diff(speeds, prepend=0.0).max() <= share * NECK.accel_rad_s2 * DT + 1e-9
    assert reason(verdicts[5]) == ("hot" if celsius > 55.0 else "too fast")
    assert verdicts[5].reasons == (f"{NAME}: {reason(verdicts[5])}",)  # and no one else
    assert verdicts[5].level == "limited"


def test_a_hot_joint_goes_on_slowly_when_it_has_cooled(world: World) -> None:
    said = [66.0, 65.0, 64.0, 63.0, 62.0]
    verdicts = [world.tick(0.5, temperature_c=celsius) for celsius in said]
    assert [reason(verdict) for verdict in verdicts] == ["hot"] * 4 + ["starting slowly"]


@pytest.mark.parametrize("load", [*np.linspace(0.3, 1.0, 29).tolist(), -0.6, -1.0])
def test_load_slows_a_joint_down_before_it_stops_it(world: World, load: float) -> None:
    stopped = slower = None
    for k in range(1000):
        verdict = world.tick(0.001 * k * DT, load=load)
        if slower is None and world.guard._health.share[JOINT] < 1.0:
            slower = k * DT
        if verdict.level == "hold":
            assert reason(verdict) == "overloaded"
            stopped = k * DT
            break
    if abs(load) <= 0.5:
        assert slower is None and stopped is None
        return
    bearable_s = 0.7 * (1.0 - 0.25) / (load * load - 0.25)
    if bearable_s < 4.9:
        assert stopped == pytest.approx(bearable_s, abs=3 * DT)
        assert slower == pytest.approx(0.5 * bearable_s, abs=3 * DT)


def test_full_load_is_let_go_before_the_servo_would(world: World) -> None:
    verdict = world.tick(0.0, load=0.0)
    while verdict.level != "hold":
        verdict = world.tick(0.08, stray=0.03, load=0.9)  # pushed by less than a stuck joint is
    assert world.t_s < 1.0
    for _ in range(60):
        verdict = world.tick(0.08, stray=0.16, load=0.9)
        assert reason(verdict) == "overloaded"
    assert verdict.command_rad[JOINT] == pytest.approx(0.16)
    assert np.abs(np.diff(world.speeds())).max() <= NECK.accel_rad_s2 * DT + 1e-9
    full_s = world.t_s
    while verdict.level == "hold":
        verdict = world.tick(0.08, stray=verdict.command_rad[JOINT], load=0.1)
    assert reason(verdict) == "starting slowly" and world.t_s - full_s > 1.0


def test_short_bursts_of_load_strain_nothing(world: World) -> None:
    for k in range(2000):  # a saccade of 60 ms at full load, three times a second
        assert world.tick(0.0, load=1.0 if k % 66 < 12 else 0.1).level == "ok"


@pytest.mark.parametrize("volts", np.linspace(3.0, 7.5, 91).tolist())
def test_voltage_slows_a_joint_down_before_it_stops_it(world: World, volts: float) -> None:
    first_hold = None
    for k in range(160):
        verdict = world.tick(0.5, voltage_v=volts)
        if verdict.level == "hold" and first_hold is None:
            assert reason(verdict) == "voltage"
            first_hold = k * DT
    room = min(volts - 3.5, 7.0 - volts)
    if room < 0.0:
        assert first_hold == pytest.approx(0.5, abs=2 * DT)
        return
    share = min(0.2 + 0.8 * room / 0.3, 1.0)
    assert first_hold is None
    assert world.speeds().max() <= share * NECK.speed_rad_s + 1e-9
    assert world.speeds().max() >= 0.9 * share * NECK.speed_rad_s


def test_a_short_sag_of_the_voltage_only_slows(world: World) -> None:
    for k in range(400):
        assert world.tick(0.5, voltage_v=3.4 if k % 100 < 49 else 5.0).level != "hold"


def test_a_supply_that_recovers_when_nothing_moves_is_given_a_rest(world: World) -> None:
    while world.tick(0.5, voltage_v=3.3).level != "hold":
        pass
    rest = 0
    while world.tick(0.5, voltage_v=5.0).level == "hold":
        rest += 1
    assert rest * DT == pytest.approx(0.5, abs=2 * DT)


def test_unknown_values_strain_nothing(world: World) -> None:
    for _ in range(100):
        verdict = world.tick(0.0, temperature_c=None, voltage_v=None, load=nan)
        assert verdict.level == "ok"
    assert world.tick(0.0, temperature_c=nan, voltage_v=nan).level == "ok"


def test_torque_off_holds_and_goes_along_with_the_joint(world: World) -> None:
    for k in range(100):  # turned by hand at 57 deg/s, then let go
        where = min(0.005 * k, 0.3)
        verdict = world.tick(-0.2, stray=where, torque=False)
        assert (verdict.level, reason(verdict)) == ("hold", "torque off")
    assert verdict.command_rad[JOINT] == pytest.approx(0.3)
    verdict = world.tick(-0.2, torque=True)
    assert reason(verdict) == "starting slowly"
    assert 0.3 - verdict.command_rad[JOINT] <= radians(300.0) * DT * DT + 1e-9


@pytest.mark.parametrize("torque", [{"torque": False}, {}])
def test_a_latched_fault_is_limp_with_its_words(world: World, torque: dict[str, bool]) -> None:
    for _ in range(80):
        verdict = world.tick(0.5, stray=0.1, fault="overload and input voltage", **torque)
        assert verdict.level == "torque_off"
        assert verdict.reasons == (f"{NAME}: overload and input voltage",)
    assert verdict.command_rad[JOINT] == pytest.approx(0.1)


def test_the_gravest_reasons_stand_by_themselves() -> None:
    guard = guarding(gentle=True)
    fault = tuple("overload" if k == JOINT else "" for k in range(9))
    joints = joints_at(ZERO, DT, fault=fault)
    verdict = guard.check((0.5,) * 9, joints, 0.0, DT)
    assert len(verdict.reasons) == 9 and verdict.critical_reasons == (f"{NAME}: overload",)
    assert World().tick(0.0).critical_reasons == ()


def test_what_still_moves_with_a_fault_moves_slowly_and_the_others_as_they_should(
    world: World,
) -> None:
    for _ in range(100):
        verdict = world.tick(0.5, fault="input voltage", torque=True)
        assert verdict.level == "torque_off" and reason(verdict) == "input voltage"
    assert 0.0 < world.speeds().max() <= radians(60.0) + 1e-9
    assert World().tick(0.5, fault="encoder", torque=True).command_rad[JOINT] == 0.0


def test_a_rearmed_joint_begins_where_it_is(world: World) -> None:
    for _ in range(40):
        world.tick(0.4)
    verdict = world.tick(0.4, stray=-0.25, rearmed=True)
    assert reason(verdict) == "starting slowly"
    assert abs(verdict.command_rad[JOINT] + 0.25) <= radians(300.0) * DT * DT + 1e-9
    began = len(world.path)
    while reason(verdict) == "starting slowly":
        verdict = world.tick(0.4)
    speeds = np.diff(world.path[began:]) / DT
    assert speeds.max() <= radians(60.0) + 1e-9 and verdict.command_rad[JOINT] > 0.38
    world.tick(0.4, stray=3.0, rearmed=True)
    assert NECK.high_rad - 1e-3 <= world.path[-1] <= NECK.high_rad
    assert np.isfinite(world.tick(0.4, stray=nan, rearmed=True).command_rad).all()
