"""The same moves of a rig in a running world, and of its exported MJCF in MuJoCo alone.

Both get the goals of the emulated servo's own profile, as MJCF has no profile generator.
"""

from collections.abc import Iterator
from math import degrees, radians
from typing import Any, Literal, NamedTuple

import numpy as np
from world_rigs import WorldBench, arm, write

from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.dynamixel.family import wanted_settings
from gazerig.robot.app.bus_wiring import servo_configs
from gazerig.robot.app.rig_description import description_of
from gazerig.robot.app.servo_drives import servo_drives
from gazerig.robot.description.mjcf import mjcf
from gazerig.sim_mock.smart_servo.physics import STEPS_PER_TURN
from gazerig.sim_mock.smart_servo.shaft import SMOOTHING

MoveKind = Literal["profile", "jump", "stall"]
SETTLED_MS = 1200


class Move(NamedTuple):
    """One move of a joint from an angle to another.

    profile: to a goal, by the speed and acceleration of the rig's file
    jump: to a goal, as fast as the servo can
    stall: to a goal, with the joint stuck
    """

    rig: str
    joint: str
    kind: MoveKind
    from_deg: float
    to_deg: float
    lasts_ms: int


class Trace(NamedTuple):
    """Angle (deg) and torque (Nm) of a joint every millisecond."""

    angle_deg: Any
    torque_nm: Any

    @property
    def speed_deg_s(self) -> Any:
        """Return the speed over 10 ms."""
        return (self.angle_deg[10:] - self.angle_deg[:-10]) * 100.0


def exported(rig: Rig) -> Any:
    """Return the MJCF that ``gazerig describe`` writes, compiled."""
    import mujoco

    description = description_of(rig, looks=False).with_drives(servo_drives(rig))
    return mujoco.MjModel.from_xml_string(mjcf(description, looks=False).xml)


class Both:
    """One move in both.

    Attributes:
        world: trace of the running world.
        plain: trace of the exported model.
    """

    def __init__(self, move: Move) -> None:
        self._move, self._rig = move, load_rig(move.rig)
        self._path: list[tuple[float, float]] = []
        self.world = self._in_world()
        self.plain = self._alone()

    # --- the running world

    def _in_world(self) -> Trace:
        move, rig, bench = self._move, self._rig, WorldBench(self._rig)
        servo, joint = bench.servos[move.joint], rig.joints[move.joint]
        if hasattr(servo, "memory"):
            configs = {one.name: one for one in servo_configs(rig)}
            for name, one in bench.servos.items():
                self._set_up(one, configs[name], rig.joints[name].gains or ())
        self._send(bench, {name: self._from_deg(name) for name in rig.names})
        bench.pass_ms(SETTLED_MS)
        if move.kind == "stall":
            servo.shaft.jam(True)
        self._send(bench, {move.joint: move.to_deg})
        self._start_rad = bench.world.joints_rad()
        at = bench.world.model.rigs[0].dof[move.joint]
        unit = STEPS_PER_TURN / joint.model_facts.steps_per_turn
        angles, torques = [], []
        for _ in range(move.lasts_ms):
            bench.pass_ms(1)
            goal = joint.angle_rad(servo.shaft.r / unit)
            jumps = not servo.shaft._cruise
            speed = 0.0 if jumps or not self._path else (goal - self._path[-1][0]) * 1000.0
            self._path.append((goal, speed))
            angles.append(degrees(bench.world.joints_rad()[move.joint]))
            torques.append(float(bench.world._data.qfrc_actuator[at]))
        return Trace(np.array(angles), np.array(torques))

    def _set_up(self, servo: Any, config: Any, gains: tuple[int, ...]) -> None:
        """Set a servo up as a run does; in a jump without a profile."""
        dynamixel = "goal_speed" not in servo.memory.registers
        if dynamixel:
            profile = ("profile_acceleration", "profile_velocity")
            for name, value in wanted_settings(config).items():
                if name not in profile or self._move.kind == "profile":
                    write(servo, name, value)
        arm(servo, gains)

    def _send(self, bench: WorldBench, goals_deg: dict[str, float]) -> None:
        for name, angle in goals_deg.items():
            servo, joint = bench.servos[name], self._rig.joints[name]
            steps = round(joint.steps(radians(angle)))
            if hasattr(servo, "memory"):
                write(servo, "goal_position", steps)
            else:
                (board,) = bench.devices.values()
                board.channels[joint.id].set_target(steps)

    def _from_deg(self, name: str) -> float:
        return self._move.from_deg if name == self._move.joint else 0.0

    # --- the exported model alone

    def _alone(self) -> Trace:
        import mujoco

        move, model = self._move, exported(self._rig)
        data, at = mujoco.MjData(model), model.joint(move.joint).dofadr[0]
        for name in self._rig.names:
            data.qpos[model.joint(name).qposadr[0]] = self._start_rad[name]
            data.actuator(name).ctrl[0] = radians(self._from_deg(name))
        for _ in range(SETTLED_MS):
            mujoco.mj_step(model, data)
        if move.kind == "stall":
            model.dof_frictionloss[at] = 20.0
        angles, torques = [], []
        has_slew = len(data.actuator(move.joint).ctrl) > 1
        smooth = 0.0
        for goal, speed in self._path:
            smooth += (speed - smooth) * SMOOTHING
            if has_slew:
                data.actuator(move.joint).ctrl[:] = goal, smooth
            else:
                data.actuator(move.joint).ctrl[0] = goal
                data.actuator(f"{move.joint}.speed").ctrl[0] = speed
            mujoco.mj_step(model, data)
            angles.append(degrees(data.qpos[model.joint(move.joint).qposadr[0]]))
            torques.append(float(data.qfrc_actuator[at]))
        return Trace(np.array(angles), np.array(torques))


_EYES = (("desk", "left_eye_pan"), ("feetech", "left_eye_pan"), ("maker", "eyes_pan"))
_NECKS = (("desk", "neck_pitch"), ("feetech", "neck_pitch"), ("expressive", "neck_yaw"))


def moves() -> Iterator[Move]:
    """Yield the moves that are compared: eyes, necks and lids of each kind of servo."""
    for rig, joint in (*_EYES, *_NECKS, ("desk", "left_upper_lid"), ("maker", "left_upper_lid")):
        if rig != "maker":  # a hobby servo has no profile
            yield Move(rig, joint, "profile", -10.0, 10.0, 400)
        yield Move(rig, joint, "jump", -10.0, 10.0, 500)
        yield Move(rig, joint, "stall", -10.0, 15.0, 200)
