"""Cost of a tick of joints: the number of calls of Python functions.

Between ticks the loop sleeps and the processor's caches are used by others, so the number of
functions is what a tick costs; counted here, as time on a shared machine means nothing.
"""

import sys
from collections import Counter

import pytest
from stand_in import StandIn

from gazerig.drivers.bus.bus_plugins import DYNAMIXEL, FEETECH, MAESTRO, PCA9685
from gazerig.robot.control.body import Body, servo_setups
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine, MaestroLine, Pca9685Line, build
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = tuple(range(1, 10))
HOBBY = tuple(HobbySpec(i, start_steps=6000) for i in IDS)

KINDS = {
    "dynamixel": (DYNAMIXEL, "xl330-m077", DynamixelLine, 16),
    "feetech": (FEETECH, "sts3215", FeetechLine, 22),
    "maestro": (MAESTRO, "hobby", MaestroLine, 106),
    "pca9685": (PCA9685, "hobby", Pca9685Line, 124),
}
"""Plug-in, model, emulated line, and the most functions of a tick of nine joints."""


def joints_of(model, **more):
    names = GAZE_JOINTS[: len(IDS)]
    return {
        name: JointParams(i, model, -30.0, 30.0, 600.0, 45_000.0, **more)
        for i, name in zip(IDS, names, strict=True)
    }


def body_of(kind, now):
    plugin, model, line, _ = KINDS[kind]
    servos = HOBBY if model == "hobby" else tuple(ServoSpec(i, model, 2048) for i in IDS)
    device = build(line(servos=servos), lambda: now[0])
    port = InProcessPort(device, sleep_until=lambda t_s: now.__setitem__(0, max(now[0], t_s)))
    joints = joints_of(model)
    return Body(plugin.make(port, servo_setups(joints, {}), plugin.params()), joints)


@pytest.mark.parametrize("kind", KINDS)
def test_a_tick_calls_few_functions(kind):
    now = [1.0]
    calls: Counter[str] = Counter()
    body = body_of(kind, now)
    body.start(SimulatedClock(now[0]))

    def count(frame, event, arg):
        path = frame.f_code.co_filename
        if path == "<string>" and frame.f_back is not None:  # a NamedTuple's
            path = frame.f_back.f_code.co_filename
        if event == "call" and "/sim_mock/" not in path and path != __file__:
            calls[f"{path}: {frame.f_code.co_name}"] += 1

    def ticks(number):
        for k in range(number):
            now[0] += 0.005
            state = body.read(now[0])
            body.write(tuple([0.001 * (k % 50) + 0.01 * i for i in IDS]))
        return state

    ticks(500)  # everything in transit has arrived
    before = sys.getprofile()
    sys.setprofile(count)
    state = ticks(100)
    sys.setprofile(before)
    assert not state.missing and len(state.position_rad) == len(IDS)
    assert sum(calls.values()) / 100 <= KINDS[kind][3], calls.most_common()


def test_straight_and_measured_linkages_of_one_body_keep_their_own_angles():
    points = ((-30.0, 1700.0), (0.0, 2048.0), (30.0, 2300.0))
    joints = joints_of("xl330-m077", sign=-1, ratio=1.5)
    bent = [name for i, name in enumerate(joints) if i % 3 == 0]
    for name in bent:
        joints[name] = JointParams(
            joints[name].id, "xl330-m077", -30.0, 30.0, 600.0, 45_000.0, transmission_points=points
        )
    sent = []

    class Bus(StandIn):
        def write(self, goals):
            sent.append(goals)

    body = Body(Bus(), joints)
    angles = tuple([0.05 * i - 0.2 for i in IDS])
    body.write(angles)
    ordered = [joints[name] for name in body.names]
    assert sent == [[round(joint.steps(a)) for joint, a in zip(ordered, angles, strict=True)]]
    back = body.angles(sent[0])
    assert back == tuple([j.angle_rad(s) for j, s in zip(ordered, sent[0], strict=True)])
    for wrong in (angles[1:], (*angles, 0.0)):
        with pytest.raises(ValueError, match="9 joints"):
            body.write(wrong)
    with pytest.raises(ValueError, match="NaN"):
        body.write((float("nan"), *angles[1:]))
