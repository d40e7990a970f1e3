"""Sections of other packages' buses, cameras, detectors and attention rules in a rig.

Such a section has the part's name and is checked like ours, by the part's own dataclass. It is held
in ``plugins`` of the section around it.
"""

import dataclasses
from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any, NamedTuple, TypeVar, cast

from gazerig.config.faults import ConfigFault
from gazerig.config.validation import Path, fault_at, validate
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
    """A checked section: the path of the section around it, and the fields to set there."""

    above: Path
    fields: dict[str, Any]


def take_plugins(
    data: dict[str, Any],
) -> tuple[dict[str, Any], list[PluginSection], list[ConfigFault]]:
    """Take the sections of plug-ins out of a rig's plain values.

    Returns:
        The other values, the sections, and the faults of those that cannot be used.
    """
    data = deepcopy(data)
    taken, faults = list[PluginSection](), list[ConfigFault]()
    for group, above, key, name, given in list(_pop_sections(data)):
        try:
            params = _section_type(group, name)
        except PluginError as error:
            faults.append(fault_at((*above, key), str(error)))
            continue
        value, wrong = validate(params, given, (*above, name))
        faults += wrong
        fields = {"plugins": {name: value}} | ({} if key == name else {key: name})
        taken.append(PluginSection(above, fields))
    return data, taken, faults


def put_plugins(value: T, taken: list[PluginSection]) -> T:
    """Return the rig with the sections of its plug-ins."""
    for one in taken:
        value = _put(value, *one)
    return value


def _put(value: Any, above: Path, fields: dict[str, Any]) -> Any:
    """Return a frozen value with other fields in the section at a path."""
    if above:
        step = str(above[0])
        mapping = isinstance(value, Mapping)
        inner = {step: _put(value[step] if mapping else getattr(value, step), above[1:], fields)}
        return {**value, **inner} if mapping else dataclasses.replace(value, **inner)
    fields = {**fields, "plugins": {**value.plugins, **fields["plugins"]}}
    return dataclasses.replace(value, **fields)


def _pop_sections(data: dict[str, Any]) -> Iterator[tuple[str, Path, str, str, Any]]:
    """Remove and yield each plug-in's group, the path above, its key, its name and its section."""
    buses = data.get("buses")
    places: list[tuple[str, Path, str, Any]] = [
        (BUS, ("bus",), "kind", data.get("bus")),
        (DETECTOR, ("detector",), "kind", data.get("detector")),
        (ATTENTION, ("gaze",), "chooser", data.get("gaze")),
    ]
    for name, bus in buses.items() if isinstance(buses, dict) else ():
        places.append((BUS, ("buses", name), "kind", bus))
    for group, above, key, holder in places:
        name = holder.get(key) if isinstance(holder, dict) else None
        if isinstance(name, str) and not is_ours(group, name):
            del holder[key]
            yield group, above, key, name, holder.pop(name, {})
    for one in registrations(CAMERA):
        if one.name in data and not one.is_ours:
            yield CAMERA, (), one.name, one.name, data.pop(one.name)


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
        add_models(name, part.models, label)
    return cast(type, part.params)
