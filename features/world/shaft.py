"""Shaft of an emulated servo with the mechanics of a world: its control loop moves a joint.

Registers, modes, profiles and protections are those of the servo. Each millisecond its control
loop computes a torque from the shaft's position. The part that depends on the speed at the end of
the millisecond (D, part of P and the induced voltage of the motor) goes into MuJoCo's implicit
step. So the equations are those of ``Shaft``, with the world's inertia, gravity, contacts
and stops. The axis of a shaft is its index in MuJoCo's arrays.
"""

from collections.abc import Sequence
from math import inf, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gazerig.features.world.model import RigIndices, shaft_rad_of
from gazerig.features.world.rig_in_world import ServoInWorld
from gazerig.sim_mock.hobby_motor import HOBBY_PHYSICS, hobby_motor
from gazerig.sim_mock.hobby_servo import HobbyServo, HobbySpec
from gazerig.sim_mock.smart_servo.physics import (
    DISABLED,
    MS_S,
    STEPS_PER_RAD,
    STEPS_PER_TURN,
    Loop,
    Motor,
    Physics,
)
from gazerig.sim_mock.smart_servo.shaft import RESOLUTION, SLOWEST, SMOOTHING, Shaft

JAM_NM = 20.0
"""Dry friction of a jammed joint."""

SPEED_UNIT = STEPS_PER_RAD * MS_S
"""Steps/ms for one rad/s."""


Effort = tuple[float, float, float, float]
"""Effort of an actuator in the next millisecond: a torque and a gain on the shaft's speed, then the
lowest and highest value of their sum; Nm, and Nm per rad/s."""
LIMP: Effort = (0.0, 0.0, 0.0, 0.0)


class ShaftAxis:
    """Shaft of one servo in a world: a tendon that turns with the servo's joints.

    Its position is in steps of an encoder with 4096 per turn, as inside emulated servos.

    Args:
        mj: the compiled model.
        data: its state.
        lead_rad: angle of each joint's shaft beyond the joint (gazerig.features.world.joint_play).
        rig: indices of the rig.
        servo: the servo.

    Attributes:
        actuator: its number in the model.
        zero, slope: its position at joint angle 0 and the steps per radian, for a linear
            transmission to one joint; slope is None if it depends on the joints' angles.
        qpos, dof: indices of its first joint.
        play_rad: half of the play of each joint with play, by the joint's qpos.
    """

    def __init__(
        self,
        mj: Any,
        data: Any,
        lead_rad: NDArray[np.float64],
        rig: RigIndices,
        servo: ServoInWorld,
    ) -> None:
        self._mj, self._data, self._lead, self._servo = mj, data, lead_rad, servo
        self.play_rad: dict[int, float] = {}
        self._tendon = rig.tendon[servo.name]
        self.actuator = rig.actuator[servo.name]
        self._qpos = tuple(rig.qpos[name] for name in servo.joints)
        self._dof = tuple(rig.dof[name] for name in servo.joints)
        self._wrap = int(mj.tendon_adr[self._tendon])
        self._unit = STEPS_PER_TURN / servo.steps_per_turn
        self._friction_nm = 0.0
        _, self._slopes = servo.transmission.at(self._angles(data.qpos))
        line = servo.transmission.line
        self.slope = None if line is None else self._unit * line[1]
        self.zero = 0.0 if line is None else self._unit * line[0]
        self.qpos, self.dof = self._qpos[0], self._dof[0]

    def _angles(self, qpos: Sequence[float]) -> list[float]:
        return [float(qpos[at]) for at in self._qpos]

    # --- every millisecond

    def motion(self, angles: Sequence[float], qvel: Sequence[float]) -> tuple[float, float]:
        """Return position in steps and speed in steps per second of a nonlinear transmission.

        Args:
            angles: of all joints, those with play turned as far as their shafts.
            qvel: speeds of all joints.
        """
        steps, slopes = self._servo.transmission.at([angles[at] for at in self._qpos])
        if slopes != self._slopes:
            self._slopes = slopes
            self._turn_with_joints()
        speed = sum(slope * qvel[at] for slope, at in zip(slopes, self._dof, strict=True))
        return self._unit * steps, self._unit * speed

    def _turn_with_joints(self) -> None:
        """Set the tendon's coefficients to the transmission's current slopes."""
        rad = shaft_rad_of(self._servo.steps_per_turn)
        for nth, slope in enumerate(self._slopes):
            self._mj.wrap_prm[self._wrap + nth] = rad * slope

    # --- on demand

    def position(self) -> float:
        """Return the position of the shaft, in steps."""
        angles = self._angles(self._data.qpos + self._lead)
        return self._unit * self._servo.transmission.at(angles)[0]

    def joint_position(self) -> float:
        """Return the position of the joint behind the play, in steps."""
        return self._unit * self._servo.transmission.at(self._angles(self._data.qpos))[0]

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, as far as its joints' stops allow.

        Two joints of a coupled pair turn as little as possible.
        """
        share = steps / self._unit / sum(slope * slope for slope in self._slopes)
        for slope, at, dof in zip(self._slopes, self._qpos, self._dof, strict=True):
            low, high = self._mj.jnt_range[self._mj.dof_jntid[dof]]
            angle = self._data.qpos[at] + share * slope
            self._data.qpos[at] = min(max(angle, low), high)

    def build(self, rotor_kg_m2: float, friction_nm: float, play_steps: float = 0.0) -> None:
        """Set the properties of a servo's motor and gear at its shaft.

        Args:
            rotor_kg_m2: inertia of the rotor behind its gear.
            friction_nm: dry friction.
            play_steps: half of the play between the shaft and the joint of its entry.
        """
        if play_steps:
            own = self._servo.joints.index(self._servo.name)
            half_rad = play_steps / abs(self._unit * self._slopes[own])
            self.play_rad = {self._qpos[own]: half_rad}
        self._mj.tendon_armature[self._tendon] = rotor_kg_m2
        self._friction_nm = friction_nm
        self.jam(False)
        self.damp(0.0)

    def damp(self, nm_s: float) -> None:
        """Set the damping torque per rad/s of the shaft."""
        self._mj.tendon_damping[self._tendon] = nm_s

    def jam(self, stuck: bool) -> None:
        """Jam the shaft at its position, or free it."""
        self._mj.tendon_frictionloss[self._tendon] = JAM_NM if stuck else self._friction_nm


class WorldShaft(Shaft):
    """A shaft with position and speed from the world."""

    __slots__ = (
        "_free_nm_s",
        "_induced_nm_s",
        "_least",
        "_most",
        "_off",
        "_profiled",
        "_stall_nm",
        "axis",
    )

    def __init__(self, model: Motor, physics: Physics, axis: ShaftAxis) -> None:
        self.axis = axis
        stall = self._stall_nm = model.stall_torque_nm
        top_rad_s = model.no_load_rpm * pi / 30.0
        self._free_nm_s = stall * physics.viscous_share / top_rad_s
        self._least = self._most = 0.0
        self._off = True
        self._profiled = 0.0
        super().__init__(model, physics, axis.position())
        self._induced_nm_s = stall * self._built.rate * SPEED_UNIT
        rotor = physics.rotor_s * stall / top_rad_s
        axis.build(rotor, stall * physics.coulomb_share, self._built.play)
        self._brake()

    @property
    def joint(self) -> float:
        """Return the position of the joint behind the play, in steps."""
        return self.axis.joint_position()

    # --- from outside

    def resume(self) -> None:
        """Continue; the world moves the shaft."""
        self.quiet = True

    def place(self, position_steps: float) -> None:
        """Set the shaft to its position in the world; ignore the given position."""
        self.x = self.axis.position()
        self.v = self.u = self.effort = 0.0
        self.start()

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, up to its joint's stops; the controller keeps acting."""
        self.axis.turn(steps)
        self.x = self.axis.position()

    def jam(self, stuck: bool) -> None:
        """Jam the shaft at its position, or free it."""
        self.axis.jam(stuck)

    # --- from the servo

    def run(self, ms: int) -> None:
        """Do nothing: the world moves its shafts."""

    def drive(self, loop: Loop) -> None:
        """Apply controller settings."""
        if loop != self._loop:
            super().drive(loop)
            self._off = loop == DISABLED
            self._brake()

    def _brake(self) -> None:
        """Let the motor brake with its induced torque, unless it is off."""
        self.axis.damp(self._free_nm_s + (0.0 if self._off else self._induced_nm_s))

    # --- from the world, every millisecond

    def command(self) -> Effort:
        """Run the control loop for one millisecond; return the effort of the motor in it."""
        if self._off:
            return LIMP
        kp, _, kd, most, slew = self._loop
        rv, before = self._rv, self.r
        r = self.lead(1)[0] if self.led else before
        if rv or r != before:
            rv += (r - before - rv) * SMOOTHING
            if -SLOWEST < rv < SLOWEST:
                rv = 0.0
        c = kp * self._error(r) + self._integral
        if rv and self._cruise:
            c += kd * rv
        self._rv = rv
        least = -most
        if slew != inf:
            u = self.u
            least, most = max(least, u - slew), min(most, u + slew)
        self._least, self._most, self._profiled = least, most, c
        push = self._stall_nm
        gain = -push * (kp + kd) * SPEED_UNIT
        return push * c, gain, push * least, push * most

    def _error(self, r: float) -> float:
        return r - self.x

    def sense(self, x: float, v: float) -> None:
        """Set position (steps) and speed (steps/ms) to the results of the world."""
        if -SLOWEST < v < SLOWEST:
            v = 0.0
        self.x = x
        self.v = v
        if self._off:
            return
        loop = self._loop
        least, most = self._least, self._most
        u = self._profiled - (loop.p + loop.d) * v
        clipped = not least <= u <= most
        if clipped:
            u = most if u > most else least
        error = self.r - self.x
        if loop.i and not clipped and abs(error) > RESOLUTION:
            i = self._integral + loop.i * error
            self._integral = min(max(i, -loop.u_max), loop.u_max)
        self.u, self.effort = u, u - v * self._built.rate


class DeadBandShaft(WorldShaft):
    """Shaft that ignores small errors."""

    __slots__ = ("dead",)

    dead: float

    def _error(self, r: float) -> float:
        error = r - self.x
        return 0.0 if -self.dead <= error <= self.dead else error


class WorldHobbyServo(HobbyServo):
    """Hobby servo in a world, with the joint that it moves.

    Args:
        spec: speed, lag, dead band and torque; the world defines its start and stops.
        axis: its shaft in the world.
        steps_per_turn: quarter microseconds per full turn.

    Attributes:
        shaft: the shaft that the world moves.
    """

    def __init__(self, spec: HobbySpec, axis: ShaftAxis, steps_per_turn: float) -> None:
        self._unit = STEPS_PER_TURN / steps_per_turn
        motor, self._loop = hobby_motor(spec, steps_per_turn)
        self.shaft = DeadBandShaft(motor, HOBBY_PHYSICS, axis)
        self.shaft.dead = spec.dead_steps * self._unit
        self._width, self._stuck = 0, False
        super().__init__(spec)

    @property
    def place_steps(self) -> float:
        """Return the position of its shaft."""
        return self.shaft.axis.position() / self._unit

    @place_steps.setter
    def place_steps(self, steps: float) -> None:
        """Do nothing: the world already has its position."""

    @property
    def width_steps(self) -> int:
        """Return the width of the received pulses, 0 without pulses."""
        return self._width

    @width_steps.setter
    def width_steps(self, steps: int) -> None:
        if steps == self._width:
            return
        was, self._width = self._width, steps
        if not steps:
            self.shaft.disable()
            return
        if not was:
            self.shaft.start()
        self.shaft.lead_to(steps * self._unit, 0.0, 0.0)
        self.shaft.drive(self._loop)

    @property
    def stuck(self) -> bool:
        """Return whether it is jammed."""
        return self._stuck

    @stuck.setter
    def stuck(self, stuck: bool) -> None:
        if stuck != self._stuck:
            self._stuck = stuck
            self.shaft.jam(stuck)

    def step(self) -> None:
        """Do nothing: the world moves it."""

    def turn(self, steps: float) -> None:
        """Turn it by hand, as far as its joint's stops allow."""
        if not self.stuck:
            self.shaft.turn(steps * self._unit)
