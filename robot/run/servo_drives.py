"""The servos of a rig as drives of its joints, from the models of the emulated servos.

Inertia, friction, controller and motor are those of the emulated servos: from data sheets, or
assumed and marked [A] in gazerig.sim_mock.smart_servo.physics and gazerig.sim_mock.hobby_motor. A
linkage that is not linear counts with its mean ratio within 10 deg of joint angle 0.
"""

from collections.abc import Mapping, Sequence
from math import pi, radians

from gazerig.config.rig import Rig
from gazerig.drivers.dynamixel.control_table import GAINS, PWM_FULL, DynamixelModel
from gazerig.drivers.dynamixel.control_table import MODELS as DYNAMIXEL
from gazerig.drivers.dynamixel.family import STEEPEST_PWM
from gazerig.drivers.feetech.memory_table import MODELS as FEETECH
from gazerig.drivers.feetech.memory_table import REGISTERS, SCS_MODELS
from gazerig.drivers.servo_bus.family import ServoModel
from gazerig.robot.description.links import ServoDrive
from gazerig.robot.model.joint import JointParams
from gazerig.robot.run.run_bus import emulated_lines
from gazerig.sim_mock.devices import MaestroLine, Pca9685Line
from gazerig.sim_mock.dynamixel.servo import POSITION, control_loop
from gazerig.sim_mock.feetech.servo import D_SHARE, P_SHARE
from gazerig.sim_mock.hobby_motor import HOBBY_PHYSICS, hobby_motor
from gazerig.sim_mock.smart_servo.physics import (
    MS_S,
    STEPS_PER_RAD,
    Loop,
    Motor,
    Physics,
    mechanics_of,
)


def servo_drives(rig: Rig) -> dict[str, ServoDrive]:
    """Return the drive of each joint whose servo's data are known, not those of a package."""
    hobby = {
        (bus, spec.channel): spec
        for bus, line in emulated_lines(rig).items()
        if isinstance(line, MaestroLine | Pca9685Line)
        for spec in line.servos
    }
    shafts = {}
    for name, joint in rig.joints.items():
        if joint.model in _SMART:
            model = _SMART[joint.model]
            motor = Motor(model.stall_torque_nm, model.no_load_rpm)
            shafts[name] = _shaft_drive(motor, Physics(), smart_loop(joint))
        elif (joint.bus, joint.id) in hobby:
            steps_per_turn = joint.model_facts.steps_per_turn
            motor, loop = hobby_motor(hobby[joint.bus, joint.id], steps_per_turn)
            shafts[name] = _shaft_drive(motor, HOBBY_PHYSICS, loop)
    turns = {name: [(name, _turns(rig.joints[name]))] for name in shafts}
    for pair in rig.couplings.values():
        if shafts.keys() >= {*pair.joints}:
            for j, name in enumerate(pair.joints):
                turns[name] = [
                    (one, _turns(rig.joints[one]) * rate[j])
                    for one, rate in zip(pair.joints, pair.rates, strict=True)
                ]
    return {name: _at_joint(shafts, of) for name, of in turns.items()}


_SMART: Mapping[str, ServoModel] = {**DYNAMIXEL, **FEETECH, **SCS_MODELS}


def smart_loop(joint: JointParams) -> Loop:
    """Return the controller of a joint's smart servo as a run configures it."""
    model, strength = _SMART[joint.model], joint.torque_limit or 1.0
    if not isinstance(model, DynamixelModel):
        p, _, d = joint.gains or (REGISTERS[f"position_{one}_gain"].initial or 0 for one in "pid")
        return Loop(p=P_SHARE * p, d=D_SHARE * d, u_max=strength)
    registers = dict(zip(GAINS, model.gains, strict=True))
    if joint.gains is not None:
        names = ("position_p_gain", "position_i_gain", "position_d_gain")
        registers |= dict(zip(names, joint.gains, strict=True))
    limit = round(strength * PWM_FULL)
    registers |= {"operating_mode": POSITION, "pwm_limit": limit, "goal_pwm": limit}
    registers["pwm_slope"] = STEEPEST_PWM
    return control_loop(lambda name: registers.get(name, 0), model)


_NEAR_ZERO_RAD = radians(10.0)


def _turns(joint: JointParams) -> float:
    """Return the signed turns of a servo for one turn of its part of the linkage, near angle 0."""
    linkage = joint.make_linkage()
    steps = linkage.steps(_NEAR_ZERO_RAD) - linkage.steps(-_NEAR_ZERO_RAD)
    return pi * steps / (joint.model_facts.steps_per_turn * _NEAR_ZERO_RAD)


def _shaft_drive(motor: Motor, physics: Physics, loop: Loop) -> ServoDrive:
    """Return the drive of a servo at its own shaft."""
    stall_nm, built = motor.stall_torque_nm, mechanics_of(motor, physics)
    top_rad_s = motor.no_load_rpm * pi / 30.0
    return ServoDrive(
        armature_kg_m2=physics.rotor_s * stall_nm / top_rad_s,
        friction_nm=physics.coulomb_share * stall_nm,
        damping_nm_s=stall_nm
        * (physics.viscous_share / top_rad_s + built.rate * STEPS_PER_RAD * MS_S),
        kp_nm_rad=stall_nm * loop.p * STEPS_PER_RAD,
        kv_nm_s=stall_nm * loop.d * STEPS_PER_RAD * MS_S,
        force_nm=stall_nm * loop.u_max,
    )


def _at_joint(shafts: Mapping[str, ServoDrive], turns: Sequence[tuple[str, float]]) -> ServoDrive:
    """Return the drive of a joint by its servos, each with its turns for one of the joint."""
    parts = []
    for name, turn in turns:
        one, square = shafts[name], turn * turn
        parts.append(
            ServoDrive(
                one.armature_kg_m2 * square,
                one.friction_nm * abs(turn),
                one.damping_nm_s * square,
                one.kp_nm_rad * square,
                one.kv_nm_s * square,
                one.force_nm * abs(turn),
            )
        )
    return ServoDrive(*map(sum, zip(*parts, strict=True)))
