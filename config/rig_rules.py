"""Rules between the sections of a rig."""

from collections.abc import Iterable
from difflib import get_close_matches

from gazerig.config.animation_rules import expressions, levels
from gazerig.config.gestures import gesture_rules
from gazerig.config.rig import Rig
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.hobby_board.params import HobbyBoardParams
from gazerig.drivers.types import ServoConfig
from gazerig.gaze.types import PARTS
from gazerig.robot.model.coupling_params import CoupledPair, pair_setups, unreachable
from gazerig.robot.model.forbidden_range import forbidden_pairs
from gazerig.robot.model.kinematics import LIDS
from gazerig.robot.model.types import GAZE_JOINTS, JOINT_NAME


def _joint_names(rig: Rig) -> Iterable[tuple[str, str]]:
    absent = [name for name in GAZE_JOINTS if name not in rig.joints]
    for name in rig.joints:
        if not JOINT_NAME.fullmatch(name):
            yield (
                f"joints.{name}",
                "no name of a joint: small letters, digits and _, a letter first, at most 40",
            )
        elif name not in GAZE_JOINTS and (near := get_close_matches(name, absent, 1, 0.8)):
            # A jaw may have any name; a neck that was misspelt would stand still without a word.
            yield f"joints.{name}", f"did you mean {near[0]}? Other joints need less similar names"
    for way in ("pan", "tilt"):
        own = [name for name in (f"left_eye_{way}", f"right_eye_{way}") if name in rig.joints]
        both = f"eyes_{way}"
        if both in rig.joints and own:
            yield f"joints.{both}", f"turns both eyes, which {' and '.join(own)} would do as well"
        elif both not in rig.joints and len(own) < 2:
            yield (
                f"joints.{both}",
                f"nothing turns {'an eye' if own else 'the eyes'} in {way}: needed are "
                f"left_eye_{way} and right_eye_{way}, or {both} where one servo turns both",
            )


def _servo_ids(rig: Rig) -> Iterable[tuple[str, str]]:
    owner: dict[tuple[str, int], str] = {}
    for name, joint in rig.joints.items():
        place = joint.bus, joint.id
        if place in owner:
            yield f"joints.{name}.id", f"id {joint.id} is already that of {owner[place]}"
        owner.setdefault(place, name)


def _models(rig: Rig) -> Iterable[tuple[str, str]]:
    for name, joint in rig.joints.items():
        if joint.model not in SERVOS:
            known = ", ".join(sorted(SERVOS))
            yield f"joints.{name}.model", f"unknown servo model {joint.model!r}; known are {known}"


def _buses(rig: Rig) -> Iterable[tuple[str, str]]:
    if "" in rig.buses:
        yield "buses", "a bus needs a name; the one without is under bus"
    ports = {"bus": rig.bus.port}
    for name, bus in rig.buses.items():
        same = next((key for key, port in ports.items() if port == bus.port), None)
        if same is not None:
            yield f"buses.{name}.port", f"{bus.port} is already that of {same}: a port has one bus"
        ports[f"buses.{name}"] = bus.port
    for name, joint in rig.joints.items():
        if joint.bus and joint.bus not in rig.buses:
            there = ", ".join(rig.buses) or "none"
            yield f"joints.{name}.bus", f"no bus {joint.bus!r} under buses; there is {there}"
        elif joint.model in SERVOS and not SERVOS[joint.model].fits(rig.bus_of(name).kind):
            kind = rig.bus_of(name).kind
            yield (
                f"joints.{name}.model",
                f"a {joint.model} speaks {SERVOS[joint.model].bus}, and its bus is of kind {kind}",
            )
        elif joint.model in SERVOS:
            yield from _channel(name, rig)
    yield from _series(rig)
    used = {joint.bus for joint in rig.joints.values()}
    for name in rig.buses:
        if name not in used:
            yield f"buses.{name}", "no joint is on it: take it out, or give joints this bus"


def _channel(name: str, rig: Rig) -> Iterable[tuple[str, str]]:
    """Find what keeps a joint from its channel of a board of hobby servos."""
    joint, params = rig.joints[name], rig.bus_of(name).section
    if not isinstance(params, HobbyBoardParams):
        return
    try:
        params.check(_setup(name, rig))
    except ValueError as error:
        what = str(error).removeprefix(f"channel {joint.id}: ")
        yield f"joints.{name}{'' if what.startswith('its range') else '.id'}", what


def _setup(name: str, rig: Rig) -> ServoConfig:
    """Return what the bus must know of a joint's servo, as far as the rig is right so far."""
    for one in rig.couplings.values():
        known = {one.first, one.second} <= rig.joints.keys() and all(
            rig.joints[joint].model in SERVOS for joint in (one.first, one.second)
        )
        pair = CoupledPair(one.first, one.second, one.made())
        if known and name in pair[:2] and not unreachable(pair, rig.joints):
            return pair_setups(pair, rig.joints, {})[name]
    return rig.joints[name].setup(name)


def _series(rig: Rig) -> Iterable[tuple[str, str]]:
    """See that servos of one bus have their numbers the same way round."""
    first: dict[str, str] = {}
    for name, joint in rig.joints.items():
        known, facts = SERVOS.get(first.setdefault(joint.bus, joint.model)), SERVOS.get(joint.model)
        if known and facts and known.bus == facts.bus and known.family != facts.family:
            yield (
                f"joints.{name}.model",
                f"a {joint.model} cannot be on one bus with a {first[joint.bus]}: their numbers "
                "have another byte first; give each series a port of its own under buses",
            )


def _lid_ranges(rig: Rig) -> Iterable[tuple[str, str]]:
    for name in LIDS:
        joint = rig.joints.get(name)
        ends = zip(rig.lid_joints.keys(name), rig.lid_joints.ends_deg(name), strict=True)
        for key, angle in ends:
            if joint is not None and angle is None:
                yield f"lid_joints.{key}", f"missing; the joint {name} needs it"
            elif joint is not None and not joint.min_deg <= (angle or 0.0) <= joint.max_deg:
                yield (
                    f"lid_joints.{key}",
                    f"{angle} is outside the joint's range {joint.min_deg}..{joint.max_deg}",
                )


def _collisions(rig: Rig) -> Iterable[tuple[str, str]]:
    """Whether the forbidden ranges leave any pose."""
    if any(True for rule in (_joint_names, _models) for _ in rule(rig)):
        return
    try:
        limits = tuple(rig.joints[name].limit() for name in rig.names)
        forbidden_pairs(rig.guard.collisions, rig.guard.collision_margin_deg, limits, rig.names)
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


def _couplings(rig: Rig) -> Iterable[tuple[str, str]]:
    """Find couplings whose servos cannot do the whole range of their joints."""
    owner: dict[str, str] = {}
    for name, coupling in rig.couplings.items():
        absent = [
            (key, joint)
            for key, joint in (("first", coupling.first), ("second", coupling.second))
            if joint not in rig.joints
        ]
        for key, joint in absent:
            there = ", ".join(rig.names)
            yield f"couplings.{name}.{key}", f"no joint {joint!r}; there is {there}"
        for joint in (coupling.first, coupling.second):
            if joint in owner:
                yield f"couplings.{name}", f"{joint} is in {owner[joint]} already"
            owner.setdefault(joint, name)
        known = not absent and all(
            rig.joints[joint].model in SERVOS for joint in (coupling.first, coupling.second)
        )
        if known:
            pair = CoupledPair(coupling.first, coupling.second, coupling.made())
            if fault := unreachable(pair, rig.joints):
                yield f"couplings.{name}", fault


def _part_names(rig: Rig) -> Iterable[tuple[str, str]]:
    for code in rig.face_parts_mm:
        if code not in PARTS:
            yield f"face_parts_mm.{code}", f"unknown face part; parts are {', '.join(PARTS)}"


RULES = (
    _joint_names,
    _servo_ids,
    _models,
    _buses,
    _lid_ranges,
    _park_ranges,
    _part_names,
    _collisions,
    _couplings,
    expressions,
    levels,
    gesture_rules,
)
"""What no single section of a rig can know."""
