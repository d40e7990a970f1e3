"""A world compiled for MuJoCo: a room or a user's MJCF, people, and a rig."""

from math import tau
from pathlib import Path
from typing import Any, NamedTuple

import mujoco

from gazerig.drivers.errors import SetupError
from gazerig.features.world.figure import Figures
from gazerig.features.world.figure_model import add_people
from gazerig.features.world.rig_in_world import RigInWorld
from gazerig.features.world.room import HOME
from gazerig.gaze.types import Mat3, Vec3

STEP_S = 0.001
"""Time step of physics, which is also that of the control loop of the emulated servos."""

MOUNT = "gazerig"
"""Name of the site in a MJCF for the neck base of the rig."""

BASE_LINK = "base_link"
"""The body of a rig that does not move; its frame is the frame of the neck base."""

ROTOR_KG_M2 = 1e-5
"""Inertia of a shaft until a servo is joined to it, so that a light lid stays stable."""

PREFIX = "rig_"
"""Prefix of the rig's names, because a room may have a head, too."""

STOP_TIME_S = 0.004
"""Time constant of a hard stop; it is damped so that nothing bounces."""


class RigIndices(NamedTuple):
    """The indices of a rig's parts in the arrays of MuJoCo.

    qpos, dof: of each joint by its name without the prefix
    tendon, actuator: of each servo, by the name of its entry
    R_world_base, p_world_base_m: pose of its neck base; everything in the rig is in this frame
    """

    rig: RigInWorld
    qpos: dict[str, int]
    dof: dict[str, int]
    tendon: dict[str, int]
    actuator: dict[str, int]
    R_world_base: Mat3
    p_world_base_m: Vec3


class WorldModel(NamedTuple):
    """A compiled world."""

    mj: Any
    figures: Figures
    rig: RigIndices


def world_spec(figures: Figures, mjcf_file: Path | None) -> Any:
    """Return a specification of a user's world, or of a room with its people.

    Args:
        figures: the people of a script, and with it their room; none: only the place of the rig.
        mjcf_file: a user's world instead of the room.

    Raises:
        SetupError: a file cannot be used.
    """
    room = figures.script.room
    if mjcf_file is None and room == "none":
        spec = mujoco.MjSpec()
        spec.worldbody.add_site(name=MOUNT)
        return spec
    path = mjcf_file or HOME / "rooms" / f"{room}.xml"
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except (ValueError, OSError) as error:
        raise SetupError(f"{path}: MuJoCo cannot read this world: {_one_line(error)}") from None
    if mjcf_file is None:
        floor_m = -figures.script.neck_height_m
        spec.body("room").pos = [0.0, 0.0, floor_m]
        for geom in spec.geoms:
            if geom.name.startswith("leg"):
                geom.fromto = [*geom.fromto[:5], floor_m]
        add_people(spec, figures)
    return spec


def world_model(figures: Figures, rig: RigInWorld, mjcf_file: Path | None = None) -> WorldModel:
    """Return a world with a rig, compiled; arguments as of ``world_spec``.

    Raises:
        SetupError: the user's file cannot be used; names the file and the remedy.
    """
    spec = world_spec(figures, mjcf_file)
    where = f"{mjcf_file}: " if mjcf_file is not None else ""
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    try:
        _place_rig(spec, rig, where)
        _add_servos(spec, rig)
        model = spec.compile()
    except ValueError as error:
        raise SetupError(f"{where}MuJoCo cannot build this world: {_one_line(error)}") from None
    return WorldModel(model, figures, _indices(model, rig))


def _one_line(error: Exception) -> str:
    """Return MuJoCo's message, which often has several lines, as one line."""
    return " ".join(str(error).split())


def _place_rig(spec: Any, rig: RigInWorld, where: str) -> None:
    """Put a rig's body at the site of its neck base.

    Raises:
        SetupError: there is none.
    """
    mount = spec.site(MOUNT)
    if mount is None:
        raise SetupError(
            f'{where}no place for the head: add <site name="{MOUNT}" pos="0 0 1"/> where its neck '
            "base stands (x forward, z up)"
        )
    xml, assets = rig.body()
    head = mujoco.MjSpec.from_string(xml, assets=dict(assets))
    for actuator in tuple(head.actuators):
        head.delete(actuator)
    spec.attach(head, prefix=PREFIX, site=mount)


def _add_servos(spec: Any, rig: RigInWorld) -> None:
    """Add the stops of joints, and a shaft for every servo: a tendon that turns with its joints."""
    for name in rig.stops_rad:
        joint = spec.joint(PREFIX + name)
        joint.limited = True
        joint.range = [-1.0, 1.0]  # set in _indices: here its unit is the file's
        joint.solref_limit = [STOP_TIME_S, 1.0]
    for servo in rig.servos:
        angles = [rig.start_rad.get(name, 0.0) for name in servo.joints]
        _, slopes = servo.transmission.at(angles)
        shaft = spec.add_tendon(name=shaft_name(servo.name), armature=ROTOR_KG_M2)
        for name, slope in zip(servo.joints, slopes, strict=True):
            shaft.wrap_joint(PREFIX + name, shaft_rad_of(servo.steps_per_turn) * slope)
        shaft.solref_friction = [2.0 * STEP_S, 1.0]
        shaft.solimp_friction = [0.9999, 0.9999, 0.001, 0.5, 2.0]
        motor = spec.add_actuator(
            name=shaft_name(servo.name),
            target=shaft_name(servo.name),
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        )
        motor.gainprm[0] = 1.0
        motor.forcelimited = True
        motor.forcerange = [-1e-9, 1e-9]


def shaft_name(servo: str) -> str:
    """Return the name of a servo's tendon and actuator; a user's world may have its own."""
    return f"{PREFIX}{servo}/shaft"


def shaft_rad_of(steps_per_turn: float) -> float:
    """Return the radians of a step of a servo's shaft."""
    return tau / steps_per_turn


def _indices(model: Any, rig: RigInWorld) -> RigIndices:
    joints = {name: model.joint(PREFIX + name) for name in rig.stops_rad}
    names = [servo.name for servo in rig.servos]
    for name, stops in rig.stops_rad.items():
        model.jnt_range[joints[name].id] = stops
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    base = data.body(PREFIX + BASE_LINK)
    a, b, c, d, e, f, g, h, i = base.xmat.tolist()
    x, y, z = base.xpos.tolist()
    return RigIndices(
        rig,
        {name: int(joint.qposadr[0]) for name, joint in joints.items()},
        {name: int(joint.dofadr[0]) for name, joint in joints.items()},
        {name: model.tendon(shaft_name(name)).id for name in names},
        {name: model.actuator(shaft_name(name)).id for name in names},
        ((a, b, c), (d, e, f), (g, h, i)),
        (x, y, z),
    )
