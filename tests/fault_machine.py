"""Complete machines under faults during motion: rig, buses, guard and true servos.

Everything runs in this process in simulated time, including the time of bytes on the wire.
Every tick checks the true positions of the servos.
"""

import json
from collections.abc import Sequence
from math import pi, radians, sin
from typing import NamedTuple

from gazerig.config.rig import Rig
from gazerig.drivers.bus.servo_models import HOBBY_KINDS, servo_label
from gazerig.robot.app.bus_wiring import rig_bus, servo_configs
from gazerig.robot.app.rig_limits import limits, park_rad
from gazerig.robot.app.run_bus import emulated_lines, servo_index
from gazerig.robot.control.body import Body
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.safety.guard import Guard
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import EmulatedMaestro
from gazerig.sim_mock.pca9685.bridge import Bridge
from gazerig.sim_mock.smart_servo.chain import ServoChain

STRUCK_S, PATIENCE_S = 1.0, 3.0
FAST = 1.3
"""Factor on its limit by which a servo may be faster while it catches up after a fault."""
ROOM_RAD = 0.03
"""Largest overshoot beyond the end of the range, by inertia."""
NEAR_RAD = 0.06
COASTS_RAD = 0.21
"""Farthest that a joint coasts whose torque goes off in motion: 136 steps of a Feetech servo."""
GIVES_RAD = 0.06
"""Largest deflection of a joint under torque by a load."""

Commands = tuple[str, ...]


class Case(NamedTuple):
    """A fault: commands that start and end it. ``{i}`` and ``{j}`` are servos of one bus.

    own_speed: the servo catches up at its own speed, because nothing can restrain it
    """

    begins: Commands
    ends: Commands = ("clear",)
    own_speed: bool = False

    @property
    def name(self) -> str:
        """Return its name."""
        return "; ".join(self.begins)


def lasting_cases(*texts: str) -> list[Case]:
    """Return faults that each last until they are cleared."""
    return [Case((text,)) for text in texts]


LINE = [
    *lasting_cases(
        "lose {i}", "lose all", "delay {i} 5", "delay {i} 60", "delay all 3",
        "delay all 30 count 12", "delay all 300 count 3", "truncate {i} 0", "truncate {i} 1",
        "truncate all 1", "duplicate {i}", "duplicate all", "corrupt {i}", "corrupt {i} 20",
        "corrupt all", "drop {i} 0", "drop {i} 1", "drop {i} -1", "drop all 0", "stall {i} 5",
        "stall {i} 30", "stall all 5", "stall all 60 count 9",
        "noise before random", "noise after random", "noise before FF", "noise after AA",
        "echo on", "babble on", "block on", "lose-writes 1000 for 1",
    ),
    Case(("unplug",), ("plug",)),
    Case(("unplug", "deny on"), ("plug", "deny off")),
    Case(("unplug for 0.02",), ("plug",)),
]  # fmt: skip
"""Faults of any line."""


class FaultOutcome(NamedTuple):
    """How a fault ended.

    end: "came back": all joints move as before; "left, named": some are limp, still or slow, and
        each is named with its cause; any other text is an error
    after_s: time from the end of the fault until then
    longest_s: the longest read
    messages: messages about it
    """

    end: str
    after_s: float
    longest_s: float
    messages: tuple[str, ...]

    @property
    def survived(self) -> bool:
        """Return whether it ended well."""
        return self.end in ("came back", "left, named")


class RuleViolation(AssertionError):
    """A servo broke a rule."""


class Machine:
    """A rig's joints on emulated buses, which the guard moves to and fro.

    said: the messages; longest_s: the longest read; heard: joints that have answered under torque
        in the last tick
    own_speed: servos may catch up at their own speed
    volts: their supply voltage, to which faults of the supply return
    room_rad: largest distance of servos outside their range, rad
    """

    volts = 5.0
    room_rad = ROOM_RAD

    def __init__(self, rig: Rig, rate_hz: float = 100.0, seed: int = 0) -> None:
        self.rig, self.period_s = rig, 1.0 / rate_hz
        self.clock = SimulatedClock(50.0)
        lines = emulated_lines(rig)
        self.devices: dict[str, Device] = {
            name: build(line, self.clock.now_s, seed) for name, line in lines.items()
        }
        ports = {
            name: InProcessPort(
                device, None, f"port of {name or 'the rig'}", self.clock.sleep_until, True
            )
            for name, device in self.devices.items()
        }
        self.body = Body(rig_bus(rig, ports), rig.joints, park_rad(rig))
        self.names = self.body.names
        self.limits = limits(rig.joints)
        self.guard = Guard(
            rig.guard, self.limits, self.names, self.body.configured_limits, self.period_s
        )
        self.setups = servo_configs(rig)
        self.linkages = [rig.joints[name].make_linkage() for name in self.names]
        self.places = [(rig.joints[name].bus, servo_index(rig, name)) for name in self.names]
        self._kinds = [rig.bus_named(rig.joints[name].bus).kind for name in self.names]
        self.heard: tuple[bool, ...] = ()
        self.said: list[str] = []
        self.longest_s = 0.0
        self.own_speed = self._loaded = False
        self._fallen: set[int] = set()
        self._fast_s = [0.0] * len(self.names)
        self._gentle_rad_s = 1.2 * radians(rig.guard.soft_start_speed_deg_s)

    def start(self) -> None:
        """Switch the torque on, and move until slow motion is over."""
        goals = self.body.start(self.clock)
        self._begin_s = self._last_s = self.clock.now_s()
        self._slot = 0
        self.guard.reset(self._last_s, goals)
        self._command, self._speed = list(goals), [0.0] * len(goals)
        self._began: tuple[bool, ...] = (False,) * len(goals)
        self._true, self._true_s = self.true_rad(), self._last_s
        for _ in range(round(2.0 / self.period_s)):
            if all(self.tick()) and not self.guard.is_gentle:
                break
        self.said.clear()
        self.longest_s = 0.0

    # --- true values

    def true_rad(self) -> list[float]:
        """Return the true angles of the joints, rad."""
        steps = {name: device.positions_steps() for name, device in self.devices.items()}
        return [
            linkage.angle_rad(steps[bus][place])
            for linkage, (bus, place) in zip(self.linkages, self.places, strict=True)
        ]

    def true_goal(self, i: int) -> int | None:
        """Return the goal that the joint's servo follows in steps; None if it is limp."""
        bus, place = self.places[i]
        device = self.devices[bus]
        if isinstance(device, EmulatedMaestro):
            return device.body.channels[place].target or None
        if isinstance(device, Bridge):
            return device.body.width_steps(place, self.clock.now_s()) or None
        if not isinstance(device, ServoChain):
            reports = json.loads(device.faults.command("status"))["servos"]
            (servo,) = (one for one in reports if one["id"] == self.setups[i].id)
            return int(servo["goal"]) if servo["torque"] else None
        servo = device.servos[place]
        return int(servo.memory.get("goal_position")) if servo.torque else None

    # --- ticks

    def desired(self, t_s: float) -> list[float]:
        """Return a sine through the middle of every range, well below its limits."""
        wave = []
        for i, limit in enumerate(self.limits):
            middle = 0.5 * (limit.low_rad + limit.high_rad)
            size = 0.3 * (limit.high_rad - limit.low_rad)
            most = (0.2 * limit.accel_rad_s2 / size) ** 0.5
            rate = min(2.0, 0.35 * limit.speed_rad_s / size, most)
            wave.append(middle + size * sin(rate * (t_s - self._begin_s) + i * pi / 5.0))
        return wave

    def tick(self) -> tuple[bool, ...]:
        """Run one tick at its time; return which joints work.

        Raises:
            RuleViolation: a servo has left its range or is too fast.
            DriverError: as in a run.
        """
        # Slots that were overrun are skipped, as in the loop.
        slots = int((self.clock.now_s() - self._begin_s) / self.period_s + 1e-6) + 1
        self._slot = slots
        self.clock.sleep_until(self._begin_s + slots * self.period_s)
        t_s = self.clock.now_s()
        joints = self.body.read(t_s)
        self.longest_s = max(self.longest_s, self.clock.now_s() - t_s)
        desired = tuple(self.desired(t_s))
        verdict = self.guard.check(desired, joints, 0.0, t_s)
        self._check_command(verdict.command_rad, joints.rearmed, t_s)
        self.body.write(verdict.command_rad)
        self.said += self.body.bus.events()
        true = self._check_servos()
        self.heard = tuple(
            name not in joints.missing and joints.torque[i] for i, name in enumerate(self.names)
        )
        return tuple(
            self.heard[i]
            and abs(true[i] - desired[i]) <= NEAR_RAD
            and abs(joints.position_rad[i] - true[i]) <= NEAR_RAD
            for i in range(len(self.names))
        )

    def _check_command(self, command: Sequence[float], rearmed: Sequence[bool], t_s: float) -> None:
        """Check range, speed and acceleration of commands, except after a joint restarted."""
        dt_s = t_s - self._last_s
        # No goal came meanwhile, and servos braked: the guard may restart from there.
        late = dt_s > 1.5 * self.period_s or self._late
        self._late = dt_s > 1.5 * self.period_s
        for i, limit in enumerate(self.limits):
            low, high, top, hard = limit[:4]
            if not low - 1e-6 <= command[i] <= high + 1e-6:
                raise RuleViolation(f"{self.names[i]} was commanded to {command[i]:.4f} rad")
            speed = (command[i] - self._command[i]) / dt_s
            if rearmed[i]:
                speed = 0.0
            elif abs(speed) > top + 1e-6:
                raise RuleViolation(f"{self.names[i]} was commanded at {speed:.3f} rad/s")
            else:
                # The position and speed at which it restarted are unknown here.
                steps = 2.0 if self._began[i] else 1.0
                most = steps * hard * max(dt_s, self._dt_s) * 1.001 + 1e-6
                if not late and abs(speed - self._speed[i]) > most:
                    raise RuleViolation(
                        f"{self.names[i]} was commanded with {speed - self._speed[i]:.3f} rad/s"
                    )
            self._command[i], self._speed[i] = command[i], speed
        self._began = tuple(rearmed)
        self._last_s, self._dt_s = t_s, dt_s

    _dt_s = 0.0
    _late = False

    def _check_servos(self) -> list[float]:
        """Check that servos are in their range and not faster than allowed."""
        now_s, true = self.clock.now_s(), self.true_rad()
        dt_s = now_s - self._true_s
        for i, (name, limit) in enumerate(zip(self.names, self.limits, strict=True)):
            goal, setup = self.true_goal(i), self.setups[i]
            moved, took_s = abs(true[i] - self._true[i]), dt_s
            if self._kinds[i] in HOBBY_KINDS:
                took_s = max(dt_s, 0.01)  # a board updates its channels at this interval
            if goal is not None and not setup.min_steps <= goal <= setup.max_steps:
                raise RuleViolation(f"{name}'s servo has goal {goal}")
            room = self.room_rad + (GIVES_RAD if self._loaded else 0.0)
            inside = limit.low_rad - room <= true[i] <= limit.high_rad + room
            if goal is None:
                self._fallen.add(i)  # nothing holds a limp joint, or brakes one in motion
                room += 0.0 if self._loaded else COASTS_RAD
                if (
                    not self._loaded
                    and not limit.low_rad - room <= true[i] <= limit.high_rad + room
                ):
                    raise RuleViolation(f"{name} is at {true[i]:.4f} rad, without torque")
            elif inside:
                self._fallen.discard(i)
            if i in self._fallen:
                continue
            if not inside:
                raise RuleViolation(f"{name} is at {true[i]:.4f} rad")
            if moved > self._gentle_rad_s * took_s + 1e-4:
                self._fast_s[i] = now_s
            if not self.own_speed and moved > FAST * limit.speed_rad_s * took_s + 0.01:
                raise RuleViolation(f"{name} moved {moved:.4f} rad in {dt_s * 1e3:.1f} ms")
        self._true, self._true_s = true, now_s
        return true

    # --- faults

    def apply_fault(
        self, bus: str, i: int, j: int, case: Case, struck_s: float = STRUCK_S
    ) -> FaultOutcome:
        """Apply a fault to a bus for a while; return how it ends.

        i, j: indices of two joints of that bus; struck_s: duration of the fault

        Raises:
            RuleViolation: a servo has left its range or is too fast.
        """
        words = {
            "i": self.setups[i].id, "j": self.setups[j].id, "volts": self.volts,
        }  # fmt: skip
        faults = self.devices[bus].faults
        self.own_speed = case.own_speed
        self.said.clear()
        self._loaded = any(text.startswith("load ") for text in case.begins)
        for text in case.begins:
            faults.command(text.format(**words))
        for _ in range(round(struck_s / self.period_s)):
            self.tick()
        for text in (*case.ends, "clear"):
            faults.command(text.format(**words))
        end_s = self.clock.now_s()
        in_a_row = 0
        while self.clock.now_s() - end_s < PATIENCE_S:
            well = self.tick()
            in_a_row = in_a_row + 1 if all(well) else 0
            if in_a_row >= 10:
                break
        after_s = self.clock.now_s() - end_s
        said = (*self.said, *self.body.bus.faults())
        return FaultOutcome(self._end_state(well, said), after_s, self.longest_s, said)

    def _end_state(self, well: Sequence[bool], said: Sequence[str]) -> str:
        if all(well):
            return "came back"
        for i, name in enumerate(self.names):
            if well[i]:
                continue
            if not any(servo_label(self.setups[i]) in line for line in said):
                return f"{name} does not work and no message gives the cause"
            if self.clock.now_s() - self._fast_s[i] < 0.5:
                return f"{name} does not work and moves fast"
        return "left, named"


def pair_of(rig: Rig, kind: str) -> tuple[str, int, int]:
    """Return the bus of a kind, and the indices of two of its joints."""
    places = [
        i for i, name in enumerate(rig.names) if rig.bus_named(rig.joints[name].bus).kind == kind
    ]
    return rig.joints[rig.names[places[0]]].bus, places[1 % len(places)], places[-1]
