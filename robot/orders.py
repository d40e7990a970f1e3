"""What people ask of a running robot, from the page, another program or the command line.

An order is plain data: it crosses processes as JSON, is obeyed at the next tick, and a
recording of a run holds it, so that the run can be done again.
"""

from collections.abc import Mapping
from math import isfinite
from typing import NamedTuple

from gaze.types import Vec3
from robot.types import JOINTS

Value = float | int | bool | str | None | tuple["Value", ...] | Mapping[str, "Value"]
"""What a key of a rig's YAML can hold."""


class Ask(NamedTuple):
    """Choose from a menu: a behaviour, a mode of conversation, what the lids do."""

    menu: str
    choice: str


class LookAt(NamedTuple):
    """Look at a point of the world in place of all that pulls; None: choose freely again."""

    p_world_m: Vec3 | None


class Jog(NamedTuple):
    """Hold all joints, and put these at angles; without any, the gaze is free again.

    angles_rad: (joint, angle) pairs
    """

    angles_rad: tuple[tuple[str, float], ...]


class Stop(NamedTuple):
    """Take the torque off at once, nothing parks; the program goes on and reads."""

    why: str


class Resume(NamedTuple):
    """Put the torque on again after a stop, where the joints are, and go on slowly."""


class Tune(NamedTuple):
    """Put parameters in force.

    changes: (dotted key of the rig's YAML, value) pairs, checked beforehand
    """

    changes: tuple[tuple[str, Value], ...]


Order = Ask | LookAt | Jog | Stop | Resume | Tune

_KINDS: dict[str, type[Order]] = {
    "ask": Ask, "look_at": LookAt, "jog": Jog, "stop": Stop, "resume": Resume, "tune": Tune,
}  # fmt: skip
_NAMES = {kind: name for name, kind in _KINDS.items()}


def as_json(order: Order) -> dict[str, object]:
    """Give an order as plain JSON: its name under "order", and its fields."""
    return {"order": _NAMES[type(order)], **order._asdict()}


def from_json(data: object) -> Order:
    """Read what ``as_json`` gave, from wherever it comes.

    Raises:
        ValueError: it is no order; the message says what is wrong and what there is.
    """
    name = data.get("order") if isinstance(data, dict) else None
    kind = _KINDS.get(name) if isinstance(name, str) else None
    if kind is None or not isinstance(data, dict):
        raise ValueError(f"no order; there is {', '.join(_KINDS)}")
    fields = {key: _frozen(value) for key, value in data.items() if key != "order"}
    if set(fields) != set(kind._fields):
        wanted = ", ".join(kind._fields) or "no fields"
        raise ValueError(f"order {name} takes {wanted}; given {', '.join(fields)}")
    order = kind(**fields)  # type: ignore[arg-type]
    check(order)
    return order


def check(order: Order) -> None:
    """See that an order's values can be meant.

    Raises:
        ValueError: with the rule.
    """
    match order:
        case Ask(menu, choice):
            if not isinstance(menu, str) or not isinstance(choice, str):
                raise ValueError("menu and choice are names")
        case LookAt(p):
            if p is not None and not (isinstance(p, tuple) and len(p) == 3 and all(map(_real, p))):
                raise ValueError("a point is three finite numbers in metres: x ahead, y left, z up")
        case Jog(angles):
            _check_angles(angles)
        case Stop(why):
            if not isinstance(why, str):
                raise ValueError("the reason of a stop is text")
        case Tune(changes):
            pairs = isinstance(changes, tuple) and all(
                isinstance(c, tuple) and len(c) == 2 and isinstance(c[0], str) for c in changes
            )
            if not pairs:
                raise ValueError("changes are pairs of a dotted key and a value")


def _check_angles(angles: object) -> None:
    if not isinstance(angles, tuple):
        raise ValueError("angles are pairs of a joint and an angle in radians")
    for pair in angles:
        if not (isinstance(pair, tuple) and len(pair) == 2 and _real(pair[1])):
            raise ValueError("angles are pairs of a joint and a finite angle in radians")
        if pair[0] not in JOINTS:
            raise ValueError(f"unknown joint {pair[0]!r}; known are {', '.join(JOINTS)}")


def _real(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _frozen(value: object) -> object:
    """Make tuples of JSON's lists."""
    if isinstance(value, list | tuple):
        return tuple(_frozen(item) for item in value)
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    return value
