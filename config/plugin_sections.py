"""Sections of other packages' buses, cameras, detectors and attention rules in a rig.

Such a section has the part's name and is checked like ours, by the part's own dataclass. It is held
in ``plugins`` of the section around it.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, TypeVar, cast

from gazerig.config.rig import Rig
from gazerig.config.validation import Path, Violation, abbreviate, validate
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
from gazerig.params import declarations

T = TypeVar("T")

_PARTS: dict[str, Any] = {
    BUS: BusPlugin,
    CAMERA: CameraPlugin,
    DETECTOR: DetectorPlugin,
    ATTENTION: AttentionPlugin,
}


class PluginSection(NamedTuple):
    """A checked section, which was taken from a rig's data.

    key: path of the key that names the part; above: path of the section around it
    """

    key: Path
    above: Path
    name: str
    params: object


def take_plugins(
    data: dict[str, Any],
) -> tuple[dict[str, Any], list[PluginSection], list[Violation]]:
    """Take the sections of plug-ins out of a rig's plain values.

    Returns:
        The other values, the sections, and the violations of those that cannot be used.
    """
    taken, found = list[PluginSection](), list[Violation]()
    for group, above, key, name in list(_named_plugins(data)):
        path = (*above, key)
        data, given = _without(data, above, key, name)
        try:
            params = _section_type(group, name)
        except PluginError as error:
            found.append(Violation(path, abbreviate(name), str(error)))
            continue
        value, wrong = validate(params, given)
        found += [one._replace(path=(*above, name, *one.path)) for one in wrong]
        taken.append(PluginSection(path, above, name, value))
    return data, taken, found


def _without(data: dict[str, Any], above: Path, *keys: str) -> tuple[dict[str, Any], Any]:
    """Return the values without keys of a section, and the value of the last of these keys."""
    if above:
        step = str(above[0])
        inner, taken = _without(data[step], above[1:], *keys)
        return {**data, step: inner}, taken
    return {k: one for k, one in data.items() if k not in keys}, data.get(keys[-1], {})


def put_plugins(value: T, taken: list[PluginSection]) -> T:
    """Return the rig with the sections of its plug-ins."""
    for one in taken:
        value = _put(value, one.above, one)
    return value


def _put(value: Any, above: Path, section: PluginSection) -> Any:
    if above and isinstance(value, Mapping):
        return {**value, above[0]: _put(value[above[0]], above[1:], section)}
    if above:
        step = str(above[0])
        return dataclasses.replace(value, **{step: _put(getattr(value, step), above[1:], section)})
    key = str(section.key[-1])
    named = {} if key == section.name else {key: section.name}
    return dataclasses.replace(
        value, plugins={**value.plugins, section.name: section.params}, **named
    )


def _named_plugins(data: Any) -> Iterator[tuple[str, Path, str, str]]:
    """Yield the group of each plug-in, the path of the section around its own, its key and name."""
    buses = data.get("buses")
    places: list[tuple[str, Path, str]] = [
        (BUS, ("bus",), "kind"),
        *((BUS, ("buses", name), "kind") for name in (buses if isinstance(buses, dict) else ())),
        (DETECTOR, ("detector",), "kind"),
        (ATTENTION, ("gaze",), "chooser"),
    ]
    for group, above, key in places:
        holder = data
        for step in above:
            holder = holder.get(step) if isinstance(holder, dict) else None
        name = holder.get(key) if isinstance(holder, dict) else None
        if isinstance(name, str) and not is_ours(group, name):
            yield group, above, key, name
    for name in data.keys() - declarations(Rig).keys():
        if any(one.name == name for one in registrations(CAMERA)):
            yield CAMERA, (), name, name


def _section_type(group: str, name: str) -> type:
    """Return the dataclass of a part's section.

    Raises:
        PluginError: the part cannot be used.
    """
    label = find(group, name).label
    part = load(group, name, _PARTS[group])
    if not (isinstance(part.params, type) and dataclasses.is_dataclass(part.params)):
        raise PluginError(f"{label}: params is not a dataclass")
    if isinstance(part, BusPlugin):
        if "baud" not in declarations(part.params):
            raise PluginError(f"{label}: its params need a field baud")
        add_models(name, part.models, part.moves, label)
    return cast(type, part.params)
