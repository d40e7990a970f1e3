"""Where the shaft of a servo is in MuJoCo's arrays: its angle, its torque, its friction."""

from collections.abc import Sequence
from typing import Any

from gazerig.features.world.model import RigIndices, shaft_rad_of
from gazerig.features.world.rig_in_world import ServoInWorld
from gazerig.sim_mock.smart_servo.controller import STEPS_PER_TURN

JAM_NM = 20.0
"""Dry friction of a jammed joint."""


class ShaftAxis:
    """One servo's shaft in a world: a tendon that turns with the servo's joints.

    Its position is in steps of an encoder with 4096 a turn, as inside emulated servos.

    Args:
        mj: mujoco.MjModel.
        data: mujoco.MjData.
        rig: whose servo it is.
        servo: which one.

    Attributes:
        actuator: its number in the model.
        zero, slope: its position at joint angle 0 and the steps a radian, of a servo that turns
            one joint by a straight gear; slope is None where that depends on the joints' angles.
        qpos, dof: of its first joint.
    """

    def __init__(self, mj: Any, data: Any, rig: RigIndices, servo: ServoInWorld) -> None:
        self._mj, self._data, self._servo = mj, data, servo
        self._tendon = rig.tendon[servo.name]
        self.actuator = rig.actuator[servo.name]
        self._qpos = tuple(rig.qpos[name] for name in servo.joints)
        self._dof = tuple(rig.dof[name] for name in servo.joints)
        self._wrap = int(mj.tendon_adr[self._tendon])
        self._unit = STEPS_PER_TURN / servo.steps_per_turn
        self._load_nm = self._friction_nm = 0.0
        self._applied_nm = [0.0] * len(self._dof)
        _, self._slopes = servo.gearing.at(self._angles(data.qpos))
        line = servo.gearing.line
        self.slope = None if line is None else self._unit * line.slope
        self.zero = 0.0 if line is None else self._unit * line.zero
        self.qpos, self.dof = self._qpos[0], self._dof[0]

    def _angles(self, qpos: Sequence[float]) -> list[float]:
        return [float(qpos[at]) for at in self._qpos]

    # --- every millisecond

    def motion(self, qpos: Sequence[float], qvel: Sequence[float]) -> tuple[float, float]:
        """Return position in steps and speed in steps a second, where the gear is not straight."""
        steps, slopes = self._servo.gearing.at([qpos[at] for at in self._qpos])
        if slopes != self._slopes:
            self._slopes = slopes
            self._turn_with_joints()
        speed = sum(slope * qvel[at] for slope, at in zip(slopes, self._dof, strict=True))
        return self._unit * steps, self._unit * speed

    def _turn_with_joints(self) -> None:
        """Let the tendon turn with the joints as the gear does where they are now."""
        rad = shaft_rad_of(self._servo.steps_per_turn)
        for nth, slope in enumerate(self._slopes):
            self._mj.wrap_prm[self._wrap + nth] = rad * slope
        if self._load_nm:
            self._apply_load()

    # --- on demand

    def position(self) -> float:
        """Return where the shaft is, in steps."""
        return self._unit * self._servo.gearing.at(self._angles(self._data.qpos))[0]

    def turn(self, steps: float) -> None:
        """Turn the shaft by hand, as far as its joints' stops allow.

        Two joints of a coupled pair turn as little as they can.
        """
        share = steps / self._unit / sum(slope * slope for slope in self._slopes)
        for slope, at, dof in zip(self._slopes, self._qpos, self._dof, strict=True):
            low, high = self._mj.jnt_range[self._mj.dof_jntid[dof]]
            angle = self._data.qpos[at] + share * slope
            self._data.qpos[at] = min(max(angle, low), high)

    def build(self, rotor_kg_m2: float, friction_nm: float, viscous_nm_s: float) -> None:
        """Set what a servo's motor and gear have at its shaft.

        Args:
            rotor_kg_m2: inertia of the rotor behind its gear.
            friction_nm: dry friction.
            viscous_nm_s: torque a rad/s that friction takes beside it.
        """
        self._mj.tendon_armature[self._tendon] = rotor_kg_m2
        self._friction_nm = friction_nm
        self.jam(False)
        self.damp(viscous_nm_s)

    def damp(self, nm_s: float) -> None:
        """Set the torque that each rad/s of the shaft takes."""
        self._mj.tendon_damping[self._tendon] = nm_s

    def jam(self, stuck: bool) -> None:
        """Jam the shaft where it is, or free it."""
        self._mj.tendon_frictionloss[self._tendon] = JAM_NM if stuck else self._friction_nm

    def load(self, nm: float) -> None:
        """Apply a constant torque to the shaft."""
        self._load_nm = nm
        self._apply_load()

    def _apply_load(self) -> None:
        """Apply the load to the joints; another servo's load may act on them, too."""
        rad = shaft_rad_of(self._servo.steps_per_turn)
        before, self._applied_nm = self._applied_nm, [self._load_nm * rad * s for s in self._slopes]
        for at, now, earlier in zip(self._dof, self._applied_nm, before, strict=True):
            self._data.qfrc_applied[at] += now - earlier
