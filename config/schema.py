"""Rigs, rule sets and face walks by name or path: read, merged and checked."""

from collections.abc import Sequence
from pathlib import Path

from gazerig.config.bounds import shapes_of
from gazerig.config.load import Check, load, read_yaml, shipped
from gazerig.config.rig import LidJoints as LidJoints
from gazerig.config.rig import Rig as Rig
from gazerig.config.rig_rules import RULES as RULES
from gazerig.gaze.attention.top_down import TopDownParams
from gazerig.gaze.scanpath.scanpath import Walk


def load_rig(
    name_or_path: str,
    character: str | None = None,
    profile: str | None = None,
    further: Sequence[Check[Rig]] = (),
) -> Rig:
    """Return a rig by shipped name or path, with every rule checked.

    Args:
        name_or_path: of the rig.
        character: name or path of a file with differences, laid over rig and profile.
        profile: name or path of a style of gaze, instead of the one that the rig names.
        further: rules besides a rig's own, such as read other files.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    layers = layers_of(name_or_path, character, profile)
    return load(layers[-1], Rig, defaults=layers[:-1], checks=(*RULES, *further))


def rig_path(name_or_path: str) -> Path:
    """Return the file of a rig by shipped name or path; a path need not exist.

    Raises:
        gazerig.config.load.ConfigError: none of that name is shipped.
    """
    return _find("rigs", name_or_path)


def layers_of(
    name_or_path: str, character: str | None = None, profile: str | None = None
) -> list[Path]:
    """Return the files that ``load_rig`` lays one over the other, the rig's own first.

    Raises:
        gazerig.config.load.ConfigError: none of that name is shipped, or the rig cannot be read.
    """
    layers = [rig_path(name_or_path)]
    named = profile or read_yaml(layers[0], tuple(shapes_of(Rig))).data.get("profile")
    if isinstance(named, str):
        layers.append(_find("profiles", named))
    if character is not None:
        layers.append(_find("characters", character))
    return layers


def load_rules(name_or_path: str) -> TopDownParams:
    """Return a rule set, behaviour -> what to look at, by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    return load(_find("rules", name_or_path), TopDownParams)


def load_walk(name_or_path: str) -> Walk:
    """Return the statistics of a face walk by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    return load(_find("scanpaths", name_or_path), Walk)


def _find(kind: str, name_or_path: str) -> Path:
    """Return the path of a file given by path (a slash or a YAML ending) or by shipped name."""
    looks_like_path = "/" in name_or_path or name_or_path.endswith((".yaml", ".yml"))
    if looks_like_path:
        return Path(name_or_path)
    return shipped(kind, name_or_path)
