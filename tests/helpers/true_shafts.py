"""Emulated rigs in simulated time, judged every millisecond on their own true shafts.

What a servo tells is rounded, late and may be wrong; here the emulator itself is asked. Speed is
the way in 5 ms, acceleration the change of the mean speed from 10 ms to the next 10: a motor's own
current loop, and the millisecond at which a goal arrives, are below that and no news of a joint.
Hobby servos hear a pulse every 20 ms and are emulated in steps of 10: there it is 20 and 20 ms.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.config.schema import Rig
from gazerig.drivers.bus.servo_models import HOBBY_KINDS
from gazerig.robot.loop.body import Body
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.types import JointAngles
from gazerig.robot.run.buses import rig_bus
from gazerig.robot.run.emulated import emulated_lines, servo_index
from gazerig.robot.run.rig_description import sag_compensation
from gazerig.robot.run.rig_limits import limits
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import Emulated, build
from gazerig.sim_mock.hobby_board import HobbyBoard
from gazerig.sim_mock.in_process_port import InProcessPort

MS_S = 0.001
SPEED_MS, ACCEL_MS = 5, 10
PULSE_MS = 20
STOP_DEG = 4.0
"""Emulated mechanical stops lie so far beyond a joint's range (robot/run/emulated.py)."""


class Shafts(SimulatedClock):
    """A simulated clock that looks at every true joint in each millisecond that passes."""

    def __init__(self, rig: Rig) -> None:
        super().__init__()
        self.rig = rig
        self.devices: dict[str, Device] = {}
        self.angles_rad: list[tuple[float, ...]] = []
        self.looking = True
        self._joints = [
            (rig.joints[name].make_linkage(), rig.joints[name].bus, servo_index(rig, name))
            for name in rig.names
        ]

    def build(self, lines: Mapping[str, Emulated]) -> dict[str, InProcessPort]:
        """Build the emulated lines on this clock."""
        self.devices = {name: build(line, self.now_s) for name, line in lines.items()}
        return {name: InProcessPort(device) for name, device in self.devices.items()}

    def truth(self) -> JointAngles:
        """Return the true present positions of the joints."""
        steps = {name: device.positions_steps() for name, device in self.devices.items()}
        return tuple([made.angle_rad(steps[bus][place]) for made, bus, place in self._joints])

    def sleep_until(self, t_s: float) -> None:
        """Let time pass, a millisecond after the other."""
        if self.looking and self.devices:
            while self._now_s + MS_S < t_s - 1e-9:
                self._now_s = round(self._now_s / MS_S + 1.0) * MS_S
                self.angles_rad.append(self.truth())
            super().sleep_until(t_s)
            self.angles_rad.append(self.truth())
        else:
            super().sleep_until(t_s)

    def clear(self) -> None:
        """Forget what was seen but for what the next windows of time need."""
        del self.angles_rad[: -2 * PULSE_MS]


class Worst(NamedTuple):
    """What a joint did at worst: degrees, seconds.

    beyond_deg: beyond its range; speed_deg_s, accel_deg_s2: over 5 and 10 ms
    stops: times that a mechanical stop was touched
    """

    beyond_deg: float
    speed_deg_s: float
    accel_deg_s2: float
    stops: int

    def joined(self, other: "Worst") -> "Worst":
        """Return the worst of both."""
        return Worst(
            max(self.beyond_deg, other.beyond_deg),
            max(self.speed_deg_s, other.speed_deg_s),
            max(self.accel_deg_s2, other.accel_deg_s2),
            self.stops + other.stops,
        )


class Judge:
    """Gathers what true joints did at worst."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        joint_limits = np.array([limit[:4] for limit in limits(rig.joints)])
        self.low, self.high, self.top, self.most = np.degrees(joint_limits.T)
        self.pulsed = np.array(
            [rig.bus_named(rig.joints[name].bus).kind in HOBBY_KINDS for name in rig.names]
        )
        self.worst = {name: Worst(-180.0, 0.0, 0.0, 0) for name in rig.names}

    def take(self, shafts: Shafts) -> None:
        """Judge what was seen since the last time, and forget it."""
        seen: NDArray[np.float64] = np.degrees(np.array(shafts.angles_rad))
        shafts.clear()
        if len(seen) <= 2 * PULSE_MS:
            return
        speed = np.where(self.pulsed, fastest(seen, PULSE_MS), fastest(seen, SPEED_MS))
        accel = np.where(self.pulsed, hardest(seen, PULSE_MS), hardest(seen, ACCEL_MS))
        beyond = np.maximum(seen - self.high, self.low - seen)
        touched = beyond >= STOP_DEG - 0.01
        hits = np.count_nonzero(touched[1:] & ~touched[:-1], axis=0)
        for i, name in enumerate(self.rig.names):
            now = Worst(
                float(beyond[:, i].max()),
                float(speed[i]),
                float(accel[i]),
                int(hits[i]),
            )
            self.worst[name] = self.worst[name].joined(now)


def fastest(angles: NDArray[np.float64], over_ms: int) -> NDArray[np.float64]:
    """Return the highest speed of each column over n rows, one a millisecond."""
    return np.abs(angles[over_ms:] - angles[:-over_ms]).max(axis=0) / (over_ms * MS_S)


def hardest(angles: NDArray[np.float64], over_ms: int) -> NDArray[np.float64]:
    """Return the highest change of the mean speed of n rows to the next n."""
    way = angles[2 * over_ms :] - 2.0 * angles[over_ms:-over_ms] + angles[: -2 * over_ms]
    return np.abs(way).max(axis=0) / (over_ms * MS_S) ** 2


class Bench:
    """A rig's guard and bus without gaze: wishes in, true shafts out."""

    def __init__(
        self,
        rig: Rig,
        where_rad: dict[str, float] | None = None,
        recover: Callable[[str], None] | None = None,
    ) -> None:
        self.rig = rig
        self.shafts = Shafts(rig)
        ports = self.shafts.build(dict(emulated_lines(rig)))
        self.names = rig.names
        for name, angle in (where_rad or {}).items():
            self.turn(name, angle)
        sag = sag_compensation(rig)
        self.body = Body(rig_bus(rig, ports), rig.joints, sag=sag, recover=recover)
        self.guard = Guard(
            rig.guard,
            limits(rig.joints),
            self.names,
            1.0 / rig.loop.rate_hz,
        )
        self.period_s = 1.0 / rig.loop.rate_hz
        self.slot = 0

    def turn(self, name: str, angle_rad: float) -> None:
        """Turn a limp joint by hand, as far as its stop."""
        joint = self.rig.joints[name]
        device, place = self.shafts.devices[joint.bus], servo_index(self.rig, name)
        steps = joint.steps(angle_rad) - device.positions_steps()[place]
        if isinstance(device, HobbyBoard):
            device.servos[place].turn(steps)
        else:
            device.servos[place].turn(steps)  # type: ignore[attr-defined]

    def start(self) -> None:
        """Switch torque on at the present positions."""
        goals = self.body.start(self.shafts)
        self.guard.reset(self.shafts.now_s(), goals)
        self._began_s = self.shafts.now_s()

    def tick(self, desired_rad: JointAngles, missed_slots: int = 0) -> JointAngles:
        """Run one tick after some missed slots; return what was sent."""
        self.slot += 1 + missed_slots
        self.shafts.sleep_until(self._began_s + self.slot * self.period_s)
        t_s = self.shafts.now_s()
        self.joints = self.body.read(t_s)
        self.verdict = self.guard.check(desired_rad, self.joints, 0.0, t_s)
        self.body.write(self.verdict.command_rad)
        return self.verdict.command_rad

    def stop(self) -> None:
        """Torque off."""
        self.body.disable_torque()

    def resume(self) -> None:
        """Switch torque on again at the present positions."""
        goals = self.body.enable_torque()
        self._began_s, self.slot = self.shafts.now_s(), 0
        self.guard.reset(self._began_s, goals)


def restless(rig: Rig, seed: int, holds_s: float = 0.6) -> Callable[[float], JointAngles]:
    """Return desired angles that jump, each joint separately, up to 5 deg outside its range."""
    rng, over = np.random.default_rng(seed), np.radians(5.0)
    ranges = [(limit.low_rad - over, limit.high_rad + over) for limit in limits(rig.joints)]
    until_s, wished = [-1.0] * len(ranges), [0.0] * len(ranges)

    def desired(t_s: float) -> JointAngles:
        for i, (low, high) in enumerate(ranges):
            if t_s >= until_s[i]:
                until_s[i] = t_s + float(rng.uniform(0.05, holds_s))
                wished[i] = float(rng.uniform(low, high))
        return tuple(wished)

    return desired
