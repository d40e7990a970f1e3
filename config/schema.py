"""Rigs, rule sets and face walks by name or path, and rules between the sections of a rig."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from math import inf, sqrt
from pathlib import Path

from gazerig.config.load import (
    Check,
    ConfigError,
    ConfigFault,
    find_file,
    load,
    read_yaml,
    shipped_names,
)
from gazerig.config.rig import LidJoints as LidJoints
from gazerig.config.rig import Rig as Rig
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.hobby_board.board import HobbyBoardParams
from gazerig.gaze.attention.top_down import TopDownParams
from gazerig.gaze.minimum_jerk import PEAK_ACCELERATION, PEAK_SPEED
from gazerig.gaze.scanpath.scanpath import Walk
from gazerig.gaze.types import PARTS
from gazerig.params import declarations, unknown_text
from gazerig.robot.model.coupling import unreachable_text
from gazerig.robot.model.guard_params import forbidden_pairs
from gazerig.robot.model.kinematics import LIDS, NECK
from gazerig.robot.model.types import GAZE_JOINTS, JOINT_NAME
from gazerig.robot.model.weight import MassParams

NO_CHARACTER = "none"
"""In place of a character's name: none, whatever the rig's file says."""


def refusal(key: str, rule: str, file: Path | str = "", line: int | None = None) -> ConfigError:
    """Return the error of one key or file."""
    return ConfigError([ConfigFault(str(file), line, key, rule)])


def load_rig(
    name_or_path: str,
    character: str | None = None,
    profile: str | None = None,
    further: Sequence[Check[Rig]] = (),
) -> Rig:
    """Return a rig by shipped name or path, after checking every rule.

    Args:
        name_or_path: name or path of the rig.
        character: name or path of a file with differences, merged over rig and profile, instead of
            the rig's; "none" for none.
        profile: name or path of a style of gaze, instead of the rig's.
        further: additional rules, such as those that read other files.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    layers = layers_of(name_or_path, character, profile)
    return load(layers[-1], Rig, defaults=layers[:-1], checks=(*RULES, *further))


def layers_of(
    name_or_path: str, character: str | None = None, profile: str | None = None
) -> list[Path]:
    """Return the files that ``load_rig`` merges, the rig's own first.

    Raises:
        gazerig.config.load.ConfigError: no shipped rig, profile or character has this name, or the
            rig cannot be read.
    """
    layers = [find_file("rigs", name_or_path)]
    rig = read_yaml(layers[0], tuple(declarations(Rig)))
    for key, given in (("profile", profile), ("character", character)):
        named = given or rig.data.get(key)
        try:
            if isinstance(named, str) and (key, named) != ("character", NO_CHARACTER):
                layers.append(find_file(f"{key}s", named))
        except ConfigError as error:
            if given:
                raise
            raise refusal(key, error.faults[0].rule, layers[0], rig.line(key)) from None
    return layers


def load_rules(name_or_path: str) -> TopDownParams:
    """Return a rule set (behaviour -> gaze target) by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    return load(find_file("rules", name_or_path), TopDownParams)


def load_walk(name_or_path: str) -> Walk:
    """Return the statistics of a face walk by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    return load(find_file("scanpaths", name_or_path), Walk)


_EYES = {*GAZE_JOINTS} - {*LIDS, *NECK}
Faults = Iterable[tuple[str, str]]
"""Dotted key and broken rule of each fault."""


def _joint_names(rig: Rig) -> Faults:
    absent = [name for name in GAZE_JOINTS if name not in rig.joints]
    for name in rig.joints:
        if not JOINT_NAME.fullmatch(name):
            yield (
                f"joints.{name}",
                "not a valid joint name: lower-case letters, digits and _, beginning with a letter, at most 40 characters",
            )
        elif name not in GAZE_JOINTS and (near := get_close_matches(name, absent, 1, 0.8)):
            # A jaw may have any name; a misspelt neck joint would not move, without a message.
            yield f"joints.{name}", f"did you mean {near[0]}? Other joints need less similar names"
    for way in ("pan", "tilt"):
        both, own = f"eyes_{way}", (f"left_eye_{way}", f"right_eye_{way}")
        if sum(name in rig.joints for name in own) != (0 if both in rig.joints else 2):
            yield (
                f"joints.{both}",
                f"use either {' and '.join(own)}, or {both} alone if one servo turns both eyes",
            )


def _owners(rig: Rig) -> Faults:
    """Find ids, ports and coupled joints with two owners."""
    owner: dict[str, str] = {}
    for key, thing in _owned(rig):
        first = owner.setdefault(thing, key)
        if first != key:
            yield key, f"{thing} is already used by {first}"


def _owned(rig: Rig) -> Faults:
    for name, joint in rig.joints.items():
        yield f"joints.{name}.id", f"id {joint.id} on {joint.bus or 'bus'}"
    for name, pair in rig.couplings.items():
        yield from ((f"couplings.{name}", joint) for joint in pair.joints)
    yield "bus.port", rig.bus.port
    for name, bus in rig.buses.items():
        yield f"buses.{name}.port", bus.port


def _servos(rig: Rig) -> Faults:
    """Find servos that are unknown, or cannot be on their bus with the others."""
    if "" in rig.buses:
        yield "buses", "a bus needs a name; the unnamed one is under bus"
    firsts: dict[str, str] = {}
    for name, joint in rig.joints.items():
        facts, bus = SERVOS.get(joint.model), {**rig.buses, "": rig.bus}.get(joint.bus)
        key = f"joints.{name}.model"
        if bus is None:
            yield f"joints.{name}.bus", unknown_text("bus", joint.bus, rig.buses)
        elif facts is None:
            yield key, unknown_text("servo model", joint.model, sorted(SERVOS))
        elif not facts.fits_bus(bus.kind):
            yield (
                key,
                f"a {joint.model} needs a bus of kind {facts.bus}, its bus is of kind {bus.kind}",
            )
        elif isinstance(bus.section, HobbyBoardParams) and joint.id >= bus.section.channels:
            yield f"joints.{name}.id", f"the board has channels 0 to {bus.section.channels - 1}"
        elif SERVOS[first := firsts.setdefault(joint.bus, joint.model)].family != facts.family:
            yield (
                key,
                f"a {joint.model} cannot be on one bus with a {first}: their byte orders differ; "
                "give each series its own port under buses",
            )


def _angles(rig: Rig) -> Faults:
    """Find poses and moves that a joint cannot do; a move has a time."""
    poses = [(f"park_deg.{name}", name, [angle], inf) for name, angle in rig.park_deg.items()]
    for name in (name for name in LIDS if name in rig.joints):
        key, lid = f"lid_joints.{rig.lid_joints.key(name)}", rig.lid_joints.ends_deg(name)
        if lid is None:
            yield key, f"missing; the joint {name} needs it: [shut, open]"
        elif lid[0] == lid[1]:
            yield key, "a lid's shut and open angles must differ"
        else:
            poses.append((key, name, list(lid), inf))
    poses += [
        (f"expressions.{face}.{name}", name, [0.0, angle], rig.expression_blend_s)
        for face, angles in rig.expressions.items()
        for name, angle in angles.items()
    ]
    poses += [
        (f"levels.{name}", one.joint, [one.low_deg, one.high_deg], one.smoothing_ms / 1e3)
        for name, one in rig.levels.items()
    ]
    for key, name, ends, time_s in poses:
        if name not in rig.joints:
            yield key, unknown_text("joint", name, rig.names)
            continue
        joint, span = rig.joints[name], max(ends) - min(ends)
        outside = [end for end in ends if not joint.min_deg <= end <= joint.max_deg]
        least_s = max(
            PEAK_SPEED * span / joint.max_speed_deg_s,
            sqrt(PEAK_ACCELERATION * span / joint.max_accel_deg_s2),
        )
        if time_s < inf and name in _EYES:
            yield key, "only gaze turns the eyes: use a lid, the neck or a further joint"
        elif outside and (time_s == inf or name not in LIDS):  # moves leave a lid within its ends
            yield key, f"{outside[0]} is outside the joint's range {joint.min_deg}..{joint.max_deg}"
        elif time_s < least_s:
            yield (
                key,
                f"{name} cannot move {span:g} deg within {time_s:g} s by its max_speed_deg_s and "
                f"max_accel_deg_s2: expression_blend_s or smoothing_ms must be at least {least_s:.2f} s",
            )


def _mechanism(rig: Rig) -> Faults:
    """Find collisions, couplings and masses that no such head can have."""
    if any(joint.model not in SERVOS for joint in rig.joints.values()):
        return
    try:
        limits = tuple(rig.joints[name].limit() for name in rig.names)
        forbidden_pairs(rig.guard.collisions, limits, rig.names)
    except ValueError as error:
        yield "guard.collisions", str(error)
    for name, pair in rig.couplings.items():
        absent = [joint for joint in pair.joints if joint not in rig.joints]
        if absent:
            yield f"couplings.{name}", unknown_text("joint", absent[0], rig.names)
        elif fault := unreachable_text(pair, rig.joints):
            yield f"couplings.{name}", fault
    if rig.mass != MassParams():
        from gazerig.robot.description.build import RigShape, head_mass_fault  # few rigs need it

        lids = dict.fromkeys(LIDS, (-0.4, 0.4))  # their angles hardly matter to the masses
        shape = RigShape(rig.name, rig.geometry, rig.joints, lids, rig.camera, rig.mass)
        if fault := head_mass_fault(shape):
            yield "mass.head.mass_kg", fault


def _names(rig: Rig) -> Faults:
    """Find names of face parts and gestures that do not exist, which would have no effect."""
    for code in rig.face_parts_mm:
        if code not in PARTS:
            yield f"face_parts_mm.{code}", unknown_text("face part", code, PARTS)
    known = [*shipped_names("tracks"), *(Path(file).stem for file in rig.track_files)]
    for behaviour, rule in rig.gaze.top_down.rules.items():
        if rule.gesture not in ("", *known):
            key = f"gaze.top_down.rules.{behaviour}.gesture"
            yield key, unknown_text("gesture", rule.gesture, known)


RULES = (
    _joint_names,
    _owners,
    _servos,
    _angles,
    _mechanism,
    _names,
)
"""Rules between several sections of a rig."""
