"""Sections of plug-ins, and the type of a rig that uses some of them.

A rig file that uses another package's bus, camera, detector or attention rule has a section with
that part's name, which is checked like ours. Its type is ``Rig`` with these sections added. A rig
without such parts is a plain ``Rig``, for which nothing is looked up.
"""

import dataclasses
import re
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Annotated, Any, NamedTuple, TypeVar, cast

from gazerig.config.rig import BusConfig, GazeConfig, Rig
from gazerig.drivers.bus.servo_models import add_models
from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import (
    ATTENTION,
    BUS,
    CAMERA,
    DETECTOR,
    AttentionPlugin,
    BusPlugin,
    CameraPlugin,
    DetectorPlugin,
    find,
    is_ours,
    load,
    registrations,
)
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.params import Choices

T = TypeVar("T")

_NAME = re.compile(r"[a-z][a-z0-9_]{0,39}")
_PARTS: dict[str, Any] = {
    BUS: BusPlugin,
    CAMERA: CameraPlugin,
    DETECTOR: DetectorPlugin,
    ATTENTION: AttentionPlugin,
}


class NamedPlugins(NamedTuple):
    """Parts of other packages that a rig uses, by group."""

    bus: tuple[str, ...] = ()
    detector: tuple[str, ...] = ()
    attention: tuple[str, ...] = ()
    camera: tuple[str, ...] = ()


NONE = NamedPlugins()


class Problem(NamedTuple):
    """A part that cannot be used: dotted key, and the reason."""

    key: str
    rule: str


def extend_type(into: type[T], data: Any) -> tuple[type[T], tuple[Problem, ...]]:
    """Return the type for a rig's data, and the problems of parts that cannot be used.

    Args:
        into: ``Rig``; any other type is returned unchanged.
        data: plain values, some of which may be checked already.
    """
    if not issubclass(into, Rig):
        return into, ()
    found: dict[str, list[str]] = {BUS: [], DETECTOR: [], ATTENTION: [], CAMERA: []}
    problems = []
    for group, key, name in _named_plugins(data):
        if is_ours(group, name) or name in found[group]:
            continue
        try:
            _section(group, name)
        except PluginError as error:
            # A name that no package registers violates its key's rule, which lists the known names.
            if any(one.name == name for one in registrations(group)):
                problems.append(Problem(key, str(error)))
            elif group != CAMERA:
                found[group].append("")
            continue
        found[group].append(name)
    named = NamedPlugins(
        *(tuple(sorted(set(found[g]))) for g in (BUS, DETECTOR, ATTENTION, CAMERA))
    )
    return cast(type[T], rig_type(named)), tuple(problems)


def _named_plugins(data: Any) -> Iterable[tuple[str, str, str]]:
    """Return group, key and name of each part that a rig uses."""
    buses = _at(data, "buses")
    chosen = [
        (BUS, "bus.kind", _at(data, "bus", "kind")),
        *(
            (BUS, f"buses.{name}.kind", _at(bus, "kind"))
            for name, bus in (buses.items() if isinstance(buses, Mapping) else ())
        ),
        (DETECTOR, "detector.kind", _at(data, "detector", "kind")),
        (ATTENTION, "gaze.chooser", _at(data, "gaze", "chooser")),
    ]
    if isinstance(data, Mapping):
        known = {field.name for field in dataclasses.fields(Rig)}
        chosen += [(CAMERA, key, key) for key in data if isinstance(key, str) and key not in known]
    yield from ((group, key, name) for group, key, name in chosen if isinstance(name, str))


def _at(value: Any, *path: str) -> Any:
    for step in path:
        value = value.get(step) if isinstance(value, Mapping) else getattr(value, step, None)
    return value


@cache
def rig_type(named: NamedPlugins) -> type[Rig]:
    """Return the type of a rig with sections of some parts; for an empty name, only the choices.

    Raises:
        PluginError: a part cannot be used.
    """
    if named == NONE:
        return Rig
    bus = _with_sections(BusConfig, BUS, "kind", named.bus)
    detector = _with_sections(FaceDetectorParams, DETECTOR, "kind", named.detector)
    gaze = _with_sections(GazeConfig, ATTENTION, "chooser", named.attention)
    says = {field.name: _description(Rig, field.name) for field in dataclasses.fields(Rig)}
    fields: list[tuple[str, Any, Any]] = [
        ("bus", Annotated[bus, says["bus"]], dataclasses.field()),
        (
            "buses",
            Annotated[Mapping[str, bus], says["buses"]],  # type: ignore[valid-type]
            dataclasses.field(default_factory=dict, kw_only=True),
        ),
        ("detector", Annotated[detector, says["detector"]], _default(detector)),
        ("gaze", Annotated[gaze, says["gaze"]], _default(gaze)),
        *(_section(CAMERA, name) for name in named.camera),
    ]
    return _create_type(Rig, fields, (rig_type, named))


@cache
def _with_sections(base: type[T], group: str, key: str, names: tuple[str, ...]) -> type[T]:
    if not names:
        return base
    known = Choices(*dict.fromkeys(one.name for one in registrations(group)))
    declared = next(f for f in dataclasses.fields(cast(Any, base)) if f.name == key)
    fields = [
        (
            key,
            Annotated[str, known, _description(base, key)],
            dataclasses.field(default=declared.default),
        ),
        *(_section(group, name) for name in names if name),
    ]
    return _create_type(base, fields, (_with_sections, base, group, key, names))


def _section(group: str, name: str) -> tuple[str, Any, Any]:
    """Return the field of a part's section."""
    label = find(group, name).label
    part = load(group, name, _PARTS[group])
    if not _NAME.fullmatch(name):
        raise PluginError(f"{label} needs another name: lower-case letters, digits and _")
    if not (isinstance(part.params, type) and dataclasses.is_dataclass(part.params)):
        raise PluginError(f"{label}: params is not a dataclass")
    if isinstance(part, BusPlugin):
        if "baud" not in {field.name for field in dataclasses.fields(part.params)}:
            raise PluginError(f"{label}: its params need a field baud")
        add_models(name, part.models, part.moves, label)
    says = f"settings of {label}"
    return name, Annotated[part.params, says], _default(part.params)


def _default(params: type) -> Any:
    try:
        params()
    except TypeError:  # a field of it has no default
        return dataclasses.field(kw_only=True)
    return dataclasses.field(default_factory=params, kw_only=True)


def _description(params: type, name: str) -> str:
    from gazerig.params import declarations

    return declarations(params)[name].description


def _create_type(
    base: type[T], fields: list[tuple[str, Any, Any]], source: tuple[Any, ...]
) -> type[T]:
    """Return a dataclass with more fields; its values can be sent to another process.

    source: the function of this module that creates it, and its arguments
    """
    make, *given = source

    def reduced(value: Any) -> Any:
        kept = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
        return _restore, (make, tuple(given), kept)

    made = dataclasses.make_dataclass(
        base.__name__, fields, bases=(base,), frozen=True, namespace={"__reduce__": reduced}
    )
    made.__module__, made.__doc__ = base.__module__, base.__doc__
    return cast(type[T], made)


def _restore(make: Callable[..., type], given: tuple[Any, ...], kept: dict[str, Any]) -> Any:
    return make(*given)(**kept)
