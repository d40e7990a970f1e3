"""Whole robots that look at people while their emulated buses are struck by faults."""

from math import degrees

import pytest
from loop_deaths import RIGS, rig_of
from mixed_rig import mixed_rig

from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rig_limits import limits
from gazerig.robot.run.run import Run

FAULTS = {
    "dynamixel": ("lose 3 for 0.3", "delay all 3 for 0.2", "unplug for 0.3", "brown-out 5"),
    "feetech": ("lose 3 for 0.3", "delay all 3 for 0.2", "unplug for 0.3", "brown-out 5"),
    "maestro": ("lose all for 0.3", "corrupt all for 0.2", "unplug for 0.3", "brown-out"),
    "pca9685": ("lose all for 0.3", "corrupt all for 0.2", "unplug for 0.3", "brown-out"),
}
STALL_S, STALL_DEG = 0.2, 3.0


class Watched:
    """A robot in simulated time."""

    def __init__(self, rig):
        self.made = Run(rig, RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
        self.bounds = limits(rig.joints)
        self.made.robot.start(self.made.clock)
        self.began_s, self.k = self.made.clock.now_s(), 0

    def tick(self):
        """Tick every 10 ms; no command is ever outside the limits."""
        self.k += 1
        self.made.clock.sleep_until(self.began_s + 0.01 * self.k)
        tick = self.made.robot.tick(self.made.clock.now_s(), 0.01)
        for angle, limit in zip(tick.guard_result.command_rad, self.bounds, strict=True):
            assert limit.low_rad - 1e-9 <= angle <= limit.high_rad + 1e-9
        return tick


@pytest.mark.parametrize("kind", RIGS)
def test_it_goes_on_looking(devices, kind):
    robot, missed = Watched(rig_of(kind)), 0
    for k in range(400):
        if k % 80 == 40 and k < 340:
            devices[0].faults.command(FAULTS[kind][k // 80])
        tick = robot.tick()
        missed += bool(tick.joints.missing)
    assert missed > 0
    assert tick.joints.missing == () and all(tick.joints.torque)
    robot.made.robot.stop()
    robot.made.close()


@pytest.mark.parametrize("struck", [0, 1, 2])
def test_what_befalls_one_bus_leaves_the_joints_of_the_others_moving(devices, tmp_path, struck):
    rig = mixed_rig(tmp_path)
    robot = Watched(rig)
    names = list(dict.fromkeys(rig.joints[name].bus for name in rig.names))
    others = {i for i, name in enumerate(rig.names) if rig.joints[name].bus != names[struck]}
    for fault, end in (("unplug", "plug"), ("lose all", "clear"), ("delay all 5", "clear")):
        devices[struck].faults.command(fault)
        seen = [robot.tick().joints for _ in range(60)]
        devices[struck].faults.command(end)
        seen += [robot.tick().joints for _ in range(80)]
        assert not any(others & set(joints.missing) for joints in seen)
        assert any(joints.missing for joints in seen) or fault == "delay all 5"
        assert seen[-1].missing == () and all(seen[-1].torque)
    robot.made.close()


@pytest.mark.parametrize("kind", ["dynamixel", "feetech"])
def test_a_jammed_joint_is_released_within_a_fifth_of_a_second(devices, kind):
    rig = rig_of(kind)
    robot, joint = Watched(rig), rig.names.index("left_eye_pan")
    for _ in range(150):
        robot.tick()
    servo_id = rig.joints["left_eye_pan"].id
    devices[0].faults.command(f"stick {servo_id}")
    run_s = longest_s = 0.0
    for _ in range(350):
        tick = robot.tick()
        lead = tick.guard_result.command_rad[joint] - tick.joints.position_rad[joint]
        run_s = run_s + 0.01 if abs(degrees(lead)) > STALL_DEG else 0.0
        longest_s = max(longest_s, run_s)
    assert 0.1 < longest_s <= STALL_S
    robot.made.close()
