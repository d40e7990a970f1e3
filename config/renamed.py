"""Keys that had another name in the version before: read for this version, reported once each.

docs/config-changes.md lists them with the date and the reason; a key leaves this table, and is
refused as unknown, with the version after.
"""

import logging
from collections.abc import Iterator, Mapping, Sequence
from functools import lru_cache
from typing import Any

from gazerig.config.entries import Entry
from gazerig.config.faults import ConfigFault
from gazerig.config.rig import Rig
from gazerig.gaze.attention.top_down import TopDownParams

RIG: Mapping[str, str] = {
    "camera_care": "camera_recovery",
    "motion.confirm_pictures": "confirm_frames",
    "joints.*.strength": "torque_limit",
    "joints.*.servo_deg_s": "servo_speed_deg_s",
    "joints.*.linkage": "transmission_points",
    "guard.stale_joints_ms": "joint_timeout_ms",
    "guard.stale_picture_ms": "frame_timeout_ms",
    "guard.gentle_ms": "soft_start_ms",
    "guard.gentle_speed_deg_s": "soft_start_speed_deg_s",
    "guard.gentle_accel_deg_s2": "soft_start_accel_deg_s2",
    "guard.stuck": "stall",
    "guard.stall.stuck_deg": "position_error_deg",
    "guard.stall.stuck_ms": "detection_ms",
    "gaze.bottom_up.slide_rad_s": "translation_reference_rad_s",
    "gaze.bottom_up.loom_1_s": "looming_reference_1_s",
    "gaze.bottom_up.spin_rad_s": "rotation_reference_rad_s",
    "gaze.bottom_up.onset_pull": "onset_salience",
    "gaze.top_down.rules.*.pull": "salience",
    "gaze.attention.stay_factor": "hysteresis_ratio",
    "gaze.attention.shortest_ms": "min_dwell_ms",
    "gaze.attention.habituation.fall_1_s": "decay_rate_1_s",
    "gaze.attention.habituation.rise_1_s": "recovery_rate_1_s",
    "gaze.attention.habituation.return_strength": "inhibition_of_return_strength",
    "gaze.attention.habituation.return_sigma_deg": "inhibition_of_return_sigma_deg",
    "gaze.attention.habituation.return_s": "inhibition_of_return_s",
    "gaze.idle.rest_pull": "rest_salience",
    "gaze.aversion.shortest_s": "min_dwell_s",
    "gaze.scanpath.walk": "transition_matrix",
    "gaze.scanpath.dwell_law": "dwell_distribution",
    "gaze.scanpath.shortest_dwell_ms": "min_dwell_ms",
    "gaze.scanpath.tempo": "rate_scale",
    "gaze.saccade.shortest_ms": "min_duration_ms",
    "gaze.head.largest_offset_deg": "max_offset_deg",
    "gaze.head.pull_least": "min_salience",
    "gaze.head.pull_most": "max_salience",
    "gaze.head.goal_by": "goal_model",
    "gaze.head.shortest_move_ms": "min_move_ms",
    "gaze.lids.interval_law": "interval_distribution",
    "gaze.lids.shortest_interval_ms": "min_interval_ms",
    "gaze.lids.evoked_middle_deg": "gaze_evoked_blink_middle_deg",
    "gaze.lids.evoked_steepness_1_deg": "gaze_evoked_blink_steepness_1_deg",
    "gaze.lids.evoked_pause_ms": "gaze_evoked_blink_pause_ms",
    "gaze.lids.evoked_literal": "gaze_evoked_blink_literal",
    "gaze.lids.evoked_literal_deg": "gaze_evoked_blink_literal_deg",
    "gaze.oculomotor.extrapolate_ms": "prediction_horizon_ms",
    "gaze.oculomotor.landing_along": "endpoint_scatter_along",
    "gaze.oculomotor.landing_across": "endpoint_scatter_across",
}
"""Old key of a rig, * for any one step -> its last step now; above it, the names of now."""
_RULES: Mapping[str, str] = {"rules.*.pull": "salience"}

_Table = Mapping[tuple[str, ...], Mapping[str, str]]
"""Steps above a key, as they are named now and * for any -> old last step -> new last step."""


def _table(names: Mapping[str, str]) -> _Table:
    found: dict[tuple[str, ...], dict[str, str]] = {}
    for key, new in names.items():
        *above, old = key.split(".")
        found.setdefault(tuple(above), {})[old] = new
    return found


_TABLES: Mapping[type, _Table] = {Rig: _table(RIG), TopDownParams: _table(_RULES)}
_LOG = logging.getLogger("gazerig.config")
_reported: set[str] = set()


def renamed(root: Entry, into: type, faults: list[ConfigFault], report: bool = True) -> Entry:
    """Return a file's entries under the names of now.

    Args:
        root: the file's top level
        into: the Params dataclass that it is read into
        faults: takes what is wrong: a key under its old and its new name at once
        report: whether each old name is logged once, with the file, the line and the new name
    """
    table = _TABLES.get(into)
    return _renamed(root, table, (), faults, report) if table else root


def renamed_key(key: str, into: type = Rig) -> str:
    """Return a dotted key, or the beginning of one, under the names of now; said once if old."""
    new = _key_now(key, into)
    if new != key:
        report_once(_line("", key, new))
    return new


@lru_cache(maxsize=2048)
def _key_now(key: str, into: type) -> str:
    table, steps = _TABLES.get(into, {}), key.split(".")
    for i, step in enumerate(steps):
        steps[i] = _names(table, steps[:i]).get(step, step)
    return ".".join(steps)


def renamed_changes(changes: Mapping[str, Any], into: type = Rig) -> dict[str, Any]:
    """Return changes with their dotted keys, and the keys of mappings in them, as named now."""
    return {
        (new := renamed_key(key, into)): _renamed_value(new, value, into)
        for key, value in changes.items()
    }


def old_keys(node: Any, into: type) -> Iterator[tuple[int, int, str]]:
    """Return where old keys stand in a text of YAML: start, end and the name of now.

    node: the top node of the text, as the YAML library composes it
    """
    table = _TABLES.get(into)
    return iter(sorted(set(_old_keys(node, table, ())))) if table else iter(())


def report_once(line: str) -> None:
    """Log a line that was not logged before in this process."""
    if line not in _reported:
        _reported.add(line)
        _LOG.warning("%s", line)


def _line(place: str, old: str, new: str) -> str:
    said = f"{old} is called {new} now; its old name is read for this version only"
    return f"{place}: {said}" if place else said


def _names(table: _Table, above: Sequence[str]) -> Mapping[str, str]:
    """Return the old names of the keys right below a path, with the new ones."""
    for pattern, names in table.items():
        if len(pattern) == len(above) and all(
            p in ("*", step) for p, step in zip(pattern, above, strict=True)
        ):
            return names
    return {}


def _renamed(
    entry: Entry, table: _Table, path: tuple[str, ...], faults: list[ConfigFault], report: bool
) -> Entry:
    if not isinstance(entry.value, dict):
        return entry
    names, held = _names(table, path), {}
    for key, below in entry.value.items():
        new = names.get(key, key)
        old_path, new_path = ".".join((*path, key)), ".".join((*path, new))
        if new != key and new in entry.value:
            rule = f"is the old name of {new}, which stands there as well; take one of them out"
            faults.append(ConfigFault(below.file, below.line, old_path, "", rule))
            continue
        if new != key and report:
            report_once(_line(f"{below.file}:{below.line}", old_path, new_path))
        held[new] = _renamed(below, table, (*path, new), faults, report)
    return Entry(held, entry.file, entry.line)


def _renamed_value(key: str, value: Any, into: type) -> Any:
    if not isinstance(value, Mapping):
        return value
    whole = renamed_changes({f"{key}.{step}": item for step, item in value.items()}, into)
    return {name.rpartition(".")[2]: item for name, item in whole.items()}


def _old_keys(node: Any, table: _Table, path: tuple[str, ...]) -> Iterator[tuple[int, int, str]]:
    # A mapping's node holds pairs of nodes, a list's the nodes of its items.
    if getattr(node, "id", "") != "mapping":
        return
    names = _names(table, path)
    for key, value in node.value:
        new = names.get(key.value) if isinstance(key.value, str) else None
        if new is not None:
            yield key.start_mark.index, key.end_mark.index, new
        yield from _old_keys(value, table, (*path, new or str(key.value)))
