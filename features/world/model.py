"""A world compiled for MuJoCo: a room or a user's MJCF, people, and a rig."""

from collections.abc import Sequence
from math import tau
from pathlib import Path
from typing import Any, NamedTuple

import mujoco

from gazerig.drivers.errors import SetupError
from gazerig.features.world.figure import Figures
from gazerig.features.world.figure_model import add_people
from gazerig.features.world.mjcf_limits import refuse_excessive
from gazerig.features.world.rig_in_world import RigInWorld
from gazerig.features.world.room_model import add_room
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.description.links import IDENTITY, ORIGIN

STEP_S = 0.001
"""Time step of physics, which is also that of the control loop of the emulated servos."""

MOUNT = "gazerig"
"""Name of the site or frame in a user's MJCF for the neck base of the rig."""

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

    names: prefix of its names in the model
    qpos, dof: of each joint by its name without the prefix
    tendon, actuator: of each servo, by the name of its entry
    R_world_base, p_world_base_m: pose of its neck base; everything in the rig is in this frame
    """

    rig: RigInWorld
    names: str
    qpos: dict[str, int]
    dof: dict[str, int]
    tendon: dict[str, int]
    actuator: dict[str, int]
    R_world_base: Mat3
    p_world_base_m: Vec3


class WorldModel(NamedTuple):
    """A compiled world."""

    mj: Any
    figures: Figures | None
    rigs: tuple[RigIndices, ...]


def world_model(
    figures: Figures | None, rigs: Sequence[RigInWorld], mjcf_file: Path | None = None
) -> WorldModel:
    """Return a room with people and a rig, compiled.

    Args:
        figures: the people of a script, and with it their room; None: an empty floor.
        rigs: the rig; () for a room without one.
        mjcf_file: a user's world instead of the room.

    Raises:
        SetupError: the user's file cannot be used; names the file and the remedy.
    """
    if mjcf_file is None:
        spec = _room_spec(figures)
    else:
        refuse_excessive(mjcf_file)
        try:
            spec = mujoco.MjSpec.from_file(str(mjcf_file))
        except (ValueError, OSError) as error:
            raise SetupError(
                f"{mjcf_file}: MuJoCo cannot read this world: {_one_line(error)}"
            ) from None
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    try:
        names = [_place_rig(spec, rig, mjcf_file) for rig in rigs]
        for rig, prefix in zip(rigs, names, strict=True):
            _add_servos(spec, rig, prefix)
        model = spec.compile()
    except ValueError as error:
        where = f"{mjcf_file}: " if mjcf_file is not None else ""
        raise SetupError(f"{where}MuJoCo cannot build this world: {_one_line(error)}") from None
    placed = zip(rigs, names, strict=True)
    return WorldModel(model, figures, tuple(_indices(model, *one) for one in placed))


def _room_spec(figures: Figures | None) -> Any:
    """Return a specification of the room and the people of a script."""
    spec = mujoco.MjSpec()
    if figures is not None:
        add_room(spec, figures.script)
        add_people(spec, figures)
        return spec
    spec.worldbody.add_light(pos=[1.0, 0.5, 2.0], dir=[-0.3, -0.2, -1.0])
    spec.worldbody.add_geom(
        name="floor",
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=[0.0, 0.0, -1.0],
        size=[5.0, 5.0, 0.1],
        rgba=[0.6, 0.55, 0.5, 1.0],
    )
    return spec


def _one_line(error: Exception) -> str:
    """Return MuJoCo's message, which often has several lines, as one line."""
    return " ".join(str(error).split())


def _place_rig(spec: Any, rig: RigInWorld, mjcf_file: Path | None) -> str:
    """Put a rig's body into the world, unless a user's world has its joints.

    Returns:
        Prefix of its names there.

    Raises:
        SetupError: the user's world has only some of its joints, or no place for it.
    """
    frame = None
    if mjcf_file is not None:
        names = list(rig.stops_rad)
        missing = [name for name in names if spec.joint(name) is None]
        if not missing:
            for actuator in tuple(spec.actuators):  # servos turn these joints instead
                if actuator.target in names:
                    spec.delete(actuator)
            return ""
        if len(missing) < len(names):
            raise SetupError(
                f"{mjcf_file}: it has some joints of the rig, but not {', '.join(missing)}: add "
                "them, or rename its own and mark a place with a site for the program's head"
            )
        frame = _mount(spec, mjcf_file)
    if frame is None:
        frame = spec.worldbody.add_frame()
    xml, assets = rig.body()
    head = mujoco.MjSpec.from_string(xml, assets=dict(assets))
    for actuator in tuple(head.actuators):
        head.delete(actuator)
    # A site and a frame have different arguments.
    where = {"site": frame} if isinstance(frame, mujoco.MjsSite) else {"frame": frame}
    spec.attach(head, prefix=PREFIX, **where)
    return PREFIX


def _mount(spec: Any, path: Path) -> Any:
    """Return the site or frame of a user's world for the neck base."""
    found = spec.site(MOUNT) or spec.frame(MOUNT)
    if found is None:
        raise SetupError(
            f'{path}: no place for the head: add <site name="{MOUNT}" pos="0 0 1"/> where its neck '
            "base stands (x forward, z up), or joints with the names of the rig's"
        )
    return found


def _add_servos(spec: Any, rig: RigInWorld, prefix: str) -> None:
    """Add the stops of joints, and a shaft for every servo: a tendon that turns with its joints."""
    for name in rig.stops_rad:
        joint = spec.joint(prefix + name)
        joint.limited = True
        joint.range = [-1.0, 1.0]  # set in _indices: here its unit is the file's
        joint.solref_limit = [STOP_TIME_S, 1.0]
    for servo in rig.servos:
        angles = [rig.start_rad.get(name, 0.0) for name in servo.joints]
        _, slopes = servo.transmission.at(angles)
        shaft = spec.add_tendon(name=shaft_name(prefix, servo.name), armature=ROTOR_KG_M2)
        for name, slope in zip(servo.joints, slopes, strict=True):
            shaft.wrap_joint(prefix + name, shaft_rad_of(servo.steps_per_turn) * slope)
        shaft.solref_friction = [2.0 * STEP_S, 1.0]
        shaft.solimp_friction = [0.9999, 0.9999, 0.001, 0.5, 2.0]
        motor = spec.add_actuator(
            name=shaft_name(prefix, servo.name),
            target=shaft_name(prefix, servo.name),
            trntype=mujoco.mjtTrn.mjTRN_TENDON,
            gaintype=mujoco.mjtGain.mjGAIN_FIXED,
            biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        )
        motor.gainprm[0] = 1.0
        motor.forcelimited = True
        motor.forcerange = [-1e-9, 1e-9]


def shaft_name(prefix: str, servo: str) -> str:
    """Return the name of a servo's tendon and actuator; a user's world may have its own."""
    return f"{prefix}{servo}/shaft"


def shaft_rad_of(steps_per_turn: float) -> float:
    """Return the radians of a step of a servo's shaft."""
    return tau / steps_per_turn


def _indices(model: Any, rig: RigInWorld, prefix: str) -> RigIndices:
    joints = {name: model.joint(prefix + name) for name in rig.stops_rad}
    names = [servo.name for servo in rig.servos]
    for name, stops in rig.stops_rad.items():
        model.jnt_range[joints[name].id] = stops
    R, p_m = _base(model, prefix)
    return RigIndices(
        rig,
        prefix,
        {name: int(joint.qposadr[0]) for name, joint in joints.items()},
        {name: int(joint.dofadr[0]) for name, joint in joints.items()},
        {name: model.tendon(shaft_name(prefix, name)).id for name in names},
        {name: model.actuator(shaft_name(prefix, name)).id for name in names},
        R,
        p_m,
    )


def _base(model: Any, prefix: str) -> tuple[Mat3, Vec3]:
    """Return the pose of a rig's neck base: its base body, or the site of a user's own head."""
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    base = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, prefix + BASE_LINK)
    site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, MOUNT)
    if base < 0 and site < 0:
        return IDENTITY, ORIGIN
    R, p = (
        (data.xmat[base], data.xpos[base])
        if base >= 0
        else (data.site_xmat[site], data.site_xpos[site])
    )
    a, b, c, d, e, f, g, h, i = R.tolist()
    x, y, z = p.tolist()
    return ((a, b, c), (d, e, f), (g, h, i)), (x, y, z)
