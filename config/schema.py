"""Rigs, rule sets and face walks by name or path, and rules between the sections of a rig."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from difflib import get_close_matches
from math import radians
from pathlib import Path
from typing import NamedTuple

from gazerig.config.load import Check, ConfigError, load, read_yaml, shipped_path
from gazerig.config.rig import LidJoints as LidJoints
from gazerig.config.rig import Rig as Rig
from gazerig.config.tracks import load_track, shipped_tracks, track_name, track_path
from gazerig.config.validation import suggestion_text
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.errors import PluginError
from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.plugins import DOOR, find
from gazerig.drivers.types import ServoConfig
from gazerig.gaze.attention.top_down import TopDownParams
from gazerig.gaze.minimum_jerk import PEAK_ACCELERATION, PEAK_SPEED
from gazerig.gaze.scanpath.scanpath import Walk
from gazerig.gaze.types import PARTS
from gazerig.params import declarations
from gazerig.robot.model.coupling import pair_setups, unreachable_text
from gazerig.robot.model.guard_params import forbidden_pairs
from gazerig.robot.model.kinematics import LIDS, NECK
from gazerig.robot.model.mass_params import MassParams
from gazerig.robot.model.types import GAZE_JOINTS, JOINT_NAME

NO_CHARACTER = "none"
"""In place of a character's name: none, whatever the rig's file says."""


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


def rig_path(name_or_path: str) -> Path:
    """Return the file of a rig by shipped name or path; a path need not exist.

    Raises:
        gazerig.config.load.ConfigError: no shipped rig has this name.
    """
    return _find("rigs", name_or_path)


def layers_of(
    name_or_path: str, character: str | None = None, profile: str | None = None
) -> list[Path]:
    """Return the files that ``load_rig`` merges, the rig's own first.

    Raises:
        gazerig.config.load.ConfigError: no shipped rig, profile or character has this name, or the
            rig cannot be read.
    """
    layers = [rig_path(name_or_path)]
    rig = read_yaml(layers[0], tuple(declarations(Rig)))
    for key, given in (("profile", profile), ("character", character)):
        named = given or rig.data.get(key)
        if not isinstance(named, str) or (key == "character" and named == NO_CHARACTER):
            continue
        try:
            layers.append(_find(f"{key}s", named))
        except ConfigError as error:
            if given:
                raise
            raise ConfigError(
                replace(fault, file=str(layers[0]), line=rig.line(key), key=key)
                for fault in error.faults
            ) from None
    return layers


def load_rules(name_or_path: str) -> TopDownParams:
    """Return a rule set (behaviour -> gaze target) by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    return load(_find("rules", name_or_path), TopDownParams)


def load_walk(name_or_path: str) -> Walk:
    """Return the statistics of a face walk by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: lists every fault.
    """
    return load(_find("scanpaths", name_or_path), Walk)


def _find(kind: str, name_or_path: str) -> Path:
    """Return the path of a file given by path (a slash or a YAML ending) or by shipped name."""
    looks_like_path = "/" in name_or_path or name_or_path.endswith((".yaml", ".yml"))
    if looks_like_path:
        return Path(name_or_path)
    return shipped_path(kind, name_or_path)


def _joint_names(rig: Rig) -> Iterable[tuple[str, str]]:
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
        own = [name for name in (f"left_eye_{way}", f"right_eye_{way}") if name in rig.joints]
        both = f"eyes_{way}"
        if both in rig.joints and own:
            yield f"joints.{both}", f"turns both eyes, so it conflicts with {' and '.join(own)}"
        elif both not in rig.joints and len(own) < 2:
            yield (
                f"joints.{both}",
                f"nothing turns {'an eye' if own else 'the eyes'} in {way}: use "
                f"left_eye_{way} and right_eye_{way}, or {both} if one servo turns both",
            )


def _servo_ids(rig: Rig) -> Iterable[tuple[str, str]]:
    owner: dict[tuple[str, int], str] = {}
    for name, joint in rig.joints.items():
        place = joint.bus, joint.id
        if place in owner:
            yield f"joints.{name}.id", f"id {joint.id} is already used by {owner[place]}"
        owner.setdefault(place, name)


def _models(rig: Rig) -> Iterable[tuple[str, str]]:
    for name, joint in rig.joints.items():
        if joint.model not in SERVOS:
            near, known = suggestion_text(joint.model.lower(), SERVOS), ", ".join(sorted(SERVOS))
            yield (
                f"joints.{name}.model",
                f"unknown servo model {joint.model!r}{near}; known models: {known}",
            )


def _buses(rig: Rig) -> Iterable[tuple[str, str]]:
    if "" in rig.buses:
        yield "buses", "a bus needs a name; the unnamed one is under bus"
    ports = {"bus": rig.bus.port}
    for name, bus in rig.buses.items():
        same = next((key for key, port in ports.items() if port == bus.port), None)
        if same is not None:
            yield f"buses.{name}.port", f"{bus.port} is already used by {same}: a port has one bus"
        ports[f"buses.{name}"] = bus.port
    for name, joint in rig.joints.items():
        if joint.bus and joint.bus not in rig.buses:
            there = ", ".join(rig.buses) or "none"
            yield f"joints.{name}.bus", f"no bus {joint.bus!r} under buses; available: {there}"
        elif joint.model in SERVOS and not SERVOS[joint.model].fits_bus(rig.bus_of(name).kind):
            kind = rig.bus_of(name).kind
            yield (
                f"joints.{name}.model",
                f"a {joint.model} needs a bus of kind {SERVOS[joint.model].bus}, its bus is of kind {kind}",
            )
        elif joint.model in SERVOS:
            yield from _channel_fault(name, rig)
    yield from _byte_order_faults(rig)
    used = {joint.bus for joint in rig.joints.values()}
    for name in rig.buses:
        if name not in used:
            yield f"buses.{name}", "no joint uses it: remove it, or assign joints to it"


_LIMPABLE = ("dynamixel", "feetech", "maestro", "pca9685")
"""Kinds of buses that can switch the torque of one servo."""


def _limp_joints(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find joints that must not or cannot be limp while the others have torque."""
    coupled = {one for pair in rig.couplings.values() for one in (pair.first, pair.second)}
    near = {one[0] for pair in rig.guard.collisions for one in (pair.first, pair.second)}
    for name, joint in rig.joints.items():
        if joint.limp_when_idle_s is None:
            continue
        bus = rig.buses.get(joint.bus, rig.bus)
        if name in NECK:
            rule = "the weight of the head would drop: a joint of the neck is never limp; remove it"
        elif name in GAZE_JOINTS:
            rule = "gaze moves this joint all the time: only further joints can be limp; remove it"
        elif name in coupled:
            rule = "two servos move it together: such a joint cannot be limp; remove it"
        elif name in near:
            rule = "it could be pushed into a collision (guard.collisions): remove it"
        elif bus.kind not in _LIMPABLE:
            kinds = ", ".join(_LIMPABLE)
            rule = f"a bus of kind {bus.kind} cannot switch one servo off, only {kinds}: remove it"
        else:
            continue
        yield f"joints.{name}.limp_when_idle_s", rule


def _channel_fault(name: str, rig: Rig) -> Iterable[tuple[str, str]]:
    """Return why a joint cannot have its channel on a board of hobby servos, "" if it can."""
    joint, params = rig.joints[name], rig.bus_of(name).section
    if not isinstance(params, HobbyBoardParams):
        return
    try:
        params.check_servo(_servo_setup(name, rig))
    except ValueError as error:
        what = str(error).removeprefix(f"channel {joint.id}: ")
        yield f"joints.{name}{'' if what.startswith('its range') else '.id'}", what


def _servo_setup(name: str, rig: Rig) -> ServoConfig:
    """Return the configuration of a joint's servo, as far as the rig is valid."""
    for one in rig.couplings.values():
        known = {*one.joints} <= rig.joints.keys() and all(
            rig.joints[joint].model in SERVOS for joint in one.joints
        )
        if known and name in one.joints and not unreachable_text(one, rig.joints):
            return pair_setups(one, rig.joints, {})[name]
    return rig.joints[name].setup(name)


def _byte_order_faults(rig: Rig) -> Iterable[tuple[str, str]]:
    """Check that servos of one bus have the same byte order."""
    first: dict[str, str] = {}
    for name, joint in rig.joints.items():
        known, facts = SERVOS.get(first.setdefault(joint.bus, joint.model)), SERVOS.get(joint.model)
        if known and facts and known.bus == facts.bus and known.family != facts.family:
            yield (
                f"joints.{name}.model",
                f"a {joint.model} cannot be on one bus with a {first[joint.bus]}: their byte orders "
                "differ; give each series its own port under buses",
            )


def _lid_ranges(rig: Rig) -> Iterable[tuple[str, str]]:
    for name in LIDS:
        joint = rig.joints.get(name)
        if joint is None:
            continue
        ends, key = rig.lid_joints.ends_deg(name), f"lid_joints.{rig.lid_joints.key(name)}"
        if ends is None:
            yield key, f"missing; the joint {name} needs it: [shut, open]"
        for angle in ends or ():
            if not joint.min_deg <= angle <= joint.max_deg:
                outside = f"{angle} is outside the joint's range {joint.min_deg}..{joint.max_deg}"
                yield key, outside


def _collisions(rig: Rig) -> Iterable[tuple[str, str]]:
    """Check whether the forbidden ranges allow any pose."""
    if any(True for rule in (_joint_names, _models) for _ in rule(rig)):
        return
    try:
        limits = tuple(rig.joints[name].limit() for name in rig.names)
        forbidden_pairs(rig.guard.collisions, limits, rig.names)
    except ValueError as error:
        yield "guard.collisions", str(error)


def _park_ranges(rig: Rig) -> Iterable[tuple[str, str]]:
    for name, angle in rig.park_deg.items():
        joint = rig.joints.get(name)
        if joint is None:
            yield f"park_deg.{name}", f"no such joint; there is {', '.join(rig.names)}"
        elif not joint.min_deg <= angle <= joint.max_deg:
            yield (
                f"park_deg.{name}",
                f"{angle} is outside the joint's range {joint.min_deg}..{joint.max_deg}",
            )


def _masses(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find masses that no such head can have."""
    if rig.mass == MassParams() or any(True for rule in (_joint_names, _models) for _ in rule(rig)):
        return
    from gazerig.robot.description.build import RigShape, rig_mass_faults  # few rigs need it

    lids = {
        name: (radians(ends[0]), radians(ends[1]))
        for name in LIDS
        if name in rig.joints and (ends := rig.lid_joints.ends_deg(name)) is not None
    }
    yield from rig_mass_faults(
        RigShape(rig.name, rig.geometry, rig.joints, lids, rig.couplings, rig.camera, rig.mass)
    )


def _couplings(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find couplings whose servos cannot move their joints over the whole range."""
    owner: dict[str, str] = {}
    for name, coupling in rig.couplings.items():
        absent = [
            (key, joint)
            for key, joint in (("first", coupling.first), ("second", coupling.second))
            if joint not in rig.joints
        ]
        for key, joint in absent:
            there = ", ".join(rig.names)
            yield f"couplings.{name}.{key}", f"no joint {joint!r}; available: {there}"
        for joint in coupling.joints:
            if joint in owner:
                yield f"couplings.{name}", f"{joint} is already in {owner[joint]}"
            owner.setdefault(joint, name)
        known = not absent and all(rig.joints[joint].model in SERVOS for joint in coupling.joints)
        if known and (fault := unreachable_text(coupling, rig.joints)):
            yield f"couplings.{name}", fault


def _part_names(rig: Rig) -> Iterable[tuple[str, str]]:
    for code in rig.face_parts_mm:
        if code not in PARTS:
            yield f"face_parts_mm.{code}", f"unknown face part; known parts: {', '.join(PARTS)}"


EYES = tuple(name for name in GAZE_JOINTS if name not in (*NECK, *LIDS))


class _KeyedMove(NamedTuple):
    """Largest move of a joint that a table can request, in degrees."""

    key: str
    joint: str
    span_deg: float
    time_s: float


def expressions(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find expressions that exceed the joints' limits."""
    ends: dict[str, tuple[float, float]] = {}
    widest: dict[str, str] = {}
    for name, angles in rig.expressions.items():
        for joint, angle in angles.items():
            key = f"expressions.{name}.{joint}"
            if fault := _joint_fault(rig, joint) or _range_fault(rig, joint, angle):
                yield key, fault
                continue
            low, high = ends.get(joint, (0.0, 0.0))
            if not low <= angle <= high:
                ends[joint], widest[joint] = (min(low, angle), max(high, angle)), key
    for joint, (low, high) in ends.items():
        move = _KeyedMove(widest[joint], joint, high - low, rig.expression_blend_s)
        yield from _too_fast(rig, move, "expression_blend_s")


def levels(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find levels that exceed their joint's limits."""
    for name, level in rig.levels.items():
        if fault := _joint_fault(rig, level.joint):
            yield f"levels.{name}.joint", fault
            continue
        ends = {"low_deg": level.low_deg, "high_deg": level.high_deg}
        faults = {end: _range_fault(rig, level.joint, angle) for end, angle in ends.items()}
        yield from ((f"levels.{name}.{end}", fault) for end, fault in faults.items() if fault)
        span = abs(level.high_deg - level.low_deg)
        key = f"levels.{name}.smoothing_ms"
        yield from _too_fast(rig, _KeyedMove(key, level.joint, span, level.smoothing_ms / 1e3), key)


def _joint_fault(rig: Rig, joint: str) -> str:
    """Return why a joint cannot be moved independently of gaze, "" if it can."""
    free = [name for name in rig.names if name not in EYES]
    if joint in EYES:
        return f"only gaze turns the eyes; joints that can be moved here: {', '.join(free)}"
    if joint not in rig.joints:
        return f"no joint {joint!r}; available: {', '.join(free)}"
    return ""


def _range_fault(rig: Rig, joint: str, angle: float) -> str:
    """Return why an angle cannot be added to a joint, "" if it can."""
    params = rig.joints[joint]
    if joint in LIDS:
        ends = rig.lid_joints.ends_deg(joint)
        if ends is None:
            return ""  # reported elsewhere
        shut, wide = ends
        if abs(angle) <= abs(wide - shut):
            return ""
        return (
            f"{angle:g} deg is more than the lid's whole range of {abs(wide - shut):g} deg "
            f"from open at {wide:g} to shut at {shut:g}"
        )
    if params.min_deg <= angle <= params.max_deg:
        return ""
    return f"{angle:g} deg is outside the joint's range {params.min_deg:g}..{params.max_deg:g}"


def _too_fast(rig: Rig, move: _KeyedMove, key: str) -> Iterable[tuple[str, str]]:
    """Return the limit that a minimum-jerk move of a joint exceeds, "" if none."""
    joint = rig.joints[move.joint]
    speed = PEAK_SPEED * move.span_deg / move.time_s
    accel = PEAK_ACCELERATION * move.span_deg / move.time_s**2
    slowest = max(
        PEAK_SPEED * move.span_deg / joint.max_speed_deg_s,
        (PEAK_ACCELERATION * move.span_deg / joint.max_accel_deg_s2) ** 0.5,
    )
    least = f"{slowest * 1e3:.0f} ms" if key.endswith("_ms") else f"{slowest:.2f} s"
    if speed > joint.max_speed_deg_s:
        limit = f"{speed:.0f} deg/s, its limit is max_speed_deg_s {joint.max_speed_deg_s:g}"
    elif accel > joint.max_accel_deg_s2:
        limit = f"{accel:.0f} deg/s2, its limit is max_accel_deg_s2 {joint.max_accel_deg_s2:g}"
    else:
        return
    yield (
        move.key,
        f"{move.joint} would move {move.span_deg:g} deg within {move.time_s:g} s: {limit}; "
        f"{key.rpartition('.')[2]} must be at least {least}",
    )


def track_rules(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find tracks with faults, and rules that name unknown tracks.

    A track that the rig cannot follow is refused when it is played, and ``gazerig check`` names it.
    """
    known = set(shipped_tracks())
    for i, file in enumerate(rig.track_files):
        try:
            track = load_track(track_path(file))
            known.add(track_name(file))
        except ConfigError as error:
            yield from ((f"track_files.{i}", str(fault)) for fault in error.faults)
        else:
            if track.sound and not Path(track.sound).is_file():
                missing = f"{file}: sound {track.sound}: no such file; check the name"
                yield f"track_files.{i}", missing
    for behaviour, rule in rig.gaze.top_down.rules.items():
        if rule.gesture and rule.gesture not in known:
            near = suggestion_text(rule.gesture, sorted(known)) or ";"
            there = ", ".join(sorted(known))
            yield (
                f"gaze.top_down.rules.{behaviour}.gesture",
                f"no gesture {rule.gesture!r}{near} available: {there}",
            )


def _doors(rig: Rig) -> Iterable[tuple[str, str]]:
    for i, entry in enumerate(rig.doors):
        try:
            find(DOOR, next(iter(entry.split()), ""))
        except PluginError as fault:
            yield f"doors.{i}", str(fault)


RULES = (
    _joint_names,
    _servo_ids,
    _models,
    _buses,
    _limp_joints,
    _lid_ranges,
    _park_ranges,
    _part_names,
    _collisions,
    _masses,
    _couplings,
    expressions,
    levels,
    track_rules,
    _doors,
)
"""Rules between several sections of a rig."""
