"""Studies and questionnaires by name or path, checked with rigs, scenes, recordings and films."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from hashlib import sha256
from os.path import isfile
from pathlib import Path
from typing import cast

from gazerig.config.export import suggestion_text
from gazerig.config.load import Check, ConfigError, load, read_yaml, shipped_path
from gazerig.config.parameters import NEXT_START, apply_changes, differences, effect_time, values
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.film_writer import film_seconds
from gazerig.features.study.design import Condition, StudyDesign
from gazerig.features.study.preregistration import canonical, design_sha256
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.rules import (
    consistency_rules,
    design_rules,
    objective_rules,
    questionnaire_rules,
)
from gazerig.features.study.shipped import HOME
from gazerig.features.study.study_run import WHOLE_SHARE
from gazerig.gaze.attention.top_down import PLANNED
from gazerig.robot.analysis.human_norms import BY_KEY
from gazerig.robot.app.scene_files import scene_names
from gazerig.robot.app.surroundings import surroundings_names
from gazerig.robot.model.commands import Value
from gazerig.robot.recording.read import BadRecording, RunRecording

_ENDS = {"recording": ".mcap", "film": ".webm"}
_GAZE = ("gaze", "ranges", "expressions", "expression_blend_s", "levels")
"""Sections of a rig that determine its appearance, whatever its servos and camera."""
_MACHINE = frozenset({"bus", "buses", "webcam", "oak", "camera", "camera_recovery"})
"""Sections that may change between two participants, such as a port or a calibration."""
_WHILE_READ = frozenset({"name", "profile", "character"})
"""Keys of a rig with only its name and the applied profile and character."""


@dataclass(frozen=True)
class LoadedStudy:
    """A checked study.

    Attributes:
        design: Its paths relative to the working folder, its questionnaires by their keys.
        questionnaires: By the keys in the design.
        rig: The study's own rig, without any condition.
        rigs: The rig of each condition, with profile, character and parameters applied.
        path: The file.
        text: Content of the file.
    """

    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    rig: Rig
    rigs: Mapping[str, Rig]
    path: Path
    text: str

    @property
    def name(self) -> str:
        """Return the name of the study's file, which is also used for its output."""
        return self.path.stem

    def changes(self, before: str | None, after: str) -> dict[str, Value]:
        """Return the changes of a running head from one condition to another, by dotted key.

        Args:
            before: the present condition; None: the head runs with the study's own rig.
            after: a condition of the same rig.
        """
        there = self.rig if before is None else self.rigs[before]
        return _differences(there, self.rigs[after])

    def changes_of_own_rig(self, condition: str) -> dict[str, Value]:
        """Return a condition's changes to its own rig, profile and character, by dotted key."""
        one = self.design.conditions[condition]
        there = load_rig(one.rig or self.design.presentation.rig, one.character, one.profile)
        return _differences(there, self.rigs[condition])

    @cached_property
    def canonical(self) -> bytes:
        """Return the hashed text: everything that is shown and asked, including defaults.

        Raises:
            OSError: a recording or a film does not exist any more.
        """
        shown: dict[str, dict[str, object]] = {}
        for condition, one in self.design.conditions.items():
            rig = self.rigs[condition]
            seen: dict[str, object] = {
                key: value for key, value in values(rig).items() if _section(key) in _GAZE
            }
            for key, value in _differences(self.rig, rig).items():
                if _section(key) not in _MACHINE:
                    seen[key] = value
            for name in _ENDS:
                file = getattr(one, name)
                if file is not None:
                    seen[f"{name}_sha256"] = sha256(Path(file).read_bytes()).hexdigest()
            shown[condition] = seen
        return canonical(self.design, self.questionnaires, shown)

    @property
    def sha256(self) -> str:
        """Return the hash for the study's data."""
        return design_sha256(self.canonical)


def load_study(name_or_path: str, *further: Check[StudyDesign]) -> LoadedStudy:
    """Return a study by shipped name or path, with its questionnaires and the conditions' rigs.

    Args:
        name_or_path: name or path of the study; its file names are relative to its own folder.
        further: additional rules, such as for scenes; they receive the design with paths relative
            to the working folder.

    Raises:
        gazerig.config.load.ConfigError: with every fault, each with the study's line.
    """
    path = _find_file("studies", name_or_path)
    folder = path.parent

    def located(check: Check[StudyDesign]) -> Check[StudyDesign]:
        return lambda raw: check(_resolve_paths(raw, folder))

    checks = [design_rules, *map(located, (_asked_faults, _rig_faults, *further))]
    design = _resolve_paths(load(path, StudyDesign, checks=checks), folder)
    files = (*design.questionnaires, *design.after)
    design = replace(
        design,
        questionnaires=tuple(Path(file).stem for file in design.questionnaires),
        after=tuple(Path(file).stem for file in design.after),
    )
    return LoadedStudy(
        design,
        {Path(file).stem: load_questionnaire(file) for file in files},
        load_rig(design.presentation.rig),
        {key: condition_rig(design, one) for key, one in design.conditions.items()},
        path,
        read_yaml(path).text,
    )


def load_questionnaire(name_or_path: str) -> Questionnaire:
    """Return a questionnaire by shipped name or path.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    path = _find_file("questionnaires", name_or_path)
    return load(path, Questionnaire, checks=(questionnaire_rules,))


def condition_rig(design: StudyDesign, condition: Condition) -> Rig:
    """Return the rig of a condition, with all its changes applied.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    rig = load_rig(condition.rig or design.presentation.rig, condition.character, condition.profile)
    return apply_changes(rig, dict(_changes(condition))) if any(_changes(condition)) else rig


def _changes(condition: Condition) -> Iterator[tuple[str, Value]]:
    """Yield a condition's changes to its rig other than files, by dotted key."""
    yield from cast(Mapping[str, Value], condition.params).items()
    if condition.scanpath is not None:
        yield _SCANPATH, condition.scanpath
    if condition.behaviour is not None and condition.behaviour != PLANNED:
        yield _BEHAVIOUR, condition.behaviour


_SCANPATH, _BEHAVIOUR = "gaze.scanpath.model", "gaze.top_down.behaviour"


def _section(key: str) -> str:
    return key.partition(".")[0]


def _differences(before: Rig, after: Rig) -> dict[str, Value]:
    """Return the changes from one rig to another, without names of files."""
    found = differences(before, after)
    return {key: value for key, value in found.items() if key not in _WHILE_READ}


def _find_file(kind: str, name_or_path: str) -> Path:
    """Return the path of a file given by path (a slash or a YAML ending) or by shipped name."""
    return (
        Path(name_or_path).expanduser()
        if _is_path(name_or_path)
        else shipped_path(kind, name_or_path, HOME)
    )


def _is_path(name_or_path: str) -> bool:
    return "/" in name_or_path or name_or_path.endswith((".yaml", ".yml"))


def _resolve_paths(design: StudyDesign, folder: Path) -> StudyDesign:
    """Return a design with paths relative to the working folder."""

    def found(name: str | None) -> str | None:
        return name if name is None or not _is_path(name) else _resolve_path(folder, name)

    conditions = {
        key: replace(
            one,
            rig=found(one.rig),
            profile=found(one.profile),
            character=found(one.character),
            recording=one.recording and _resolve_path(folder, one.recording),
            film=one.film and _resolve_path(folder, one.film),
        )
        for key, one in design.conditions.items()
    }
    shown = design.presentation
    return replace(
        design,
        conditions=conditions,
        questionnaires=tuple(found(one) or "" for one in design.questionnaires),
        after=tuple(found(one) or "" for one in design.after),
        presentation=replace(shown, rig=found(shown.rig) or "", world=found(shown.world)),
    )


def _resolve_path(folder: Path, name: str) -> str:
    return str(folder / Path(name).expanduser())


def _asked_faults(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield unreadable questionnaires, and contradictions with the readable ones."""
    found: dict[str, Questionnaire] = {}
    for list_name in ("questionnaires", "after"):
        files = getattr(design, list_name)
        for i, file in enumerate(files):
            try:
                found[Path(file).stem] = load_questionnaire(file)
            except ConfigError as error:
                yield from _faults_at_key(f"{list_name}.{i}", error)
    keys = replace(
        design,
        questionnaires=tuple(Path(file).stem for file in design.questionnaires),
        after=tuple(Path(file).stem for file in design.after),
    )
    yield from consistency_rules(keys, found)


def _rig_faults(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield conditions that cannot be shown at all, or on a running head, or are equal."""
    try:
        own: Rig | None = load_rig(design.presentation.rig)
    except ConfigError as error:
        yield from _faults_at_key("presentation.rig", error)
        own = None
    rigs: dict[str, Rig] = {}
    for key, one in design.conditions.items():
        if own is None and one.rig is None:
            continue
        try:
            rigs[key] = condition_rig(design, one)
        except ConfigError as error:
            yield from _condition_faults(f"conditions.{key}", one, error)
            continue
        for name, ending in _ENDS.items():
            file, at = getattr(one, name), f"conditions.{key}.{name}"
            if file is not None and not file.endswith(ending):
                yield at, f"{file} does not end in {ending}; name such a file"
            elif file is not None and not isfile(file):
                yield at, f"there is no file {file}; check the name"
        if own is not None:
            yield from _start_faults(design, key, own, rigs[key])
    for i, key in enumerate(rigs):
        for other in list(rigs)[:i]:
            if _show_same(design, rigs, key, other):
                rule = (
                    f"cannot be told apart from {other!r}: both show the same; change a value of "
                    "one of them, or leave it out"
                )
                yield f"conditions.{key}", rule
                break


def _condition_faults(at: str, one: Condition, error: ConfigError) -> Iterator[tuple[str, str]]:
    """Yield the faults of a condition's files and parameters, each at the key that caused it."""
    kinds = {"config/rigs": "rig", "config/profiles": "profile", "config/characters": "character"}
    for fault in error.faults:
        if fault.file in kinds:
            yield f"{at}.{kinds[fault.file]}", fault.rule
        elif fault.file:  # in a file that the key names
            named = (name for name in kinds.values() if getattr(one, name) == fault.file)
            yield f"{at}.{next(named, 'rig')}".removesuffix(".rig"), str(fault)
        elif fault.key == _BEHAVIOUR or (one.behaviour and "behaviour" in fault.rule):
            yield f"{at}.behaviour", fault.rule
        else:
            given = (key for key in one.params if f"{fault.key}.".startswith(f"{key}."))
            key = next(given, None)
            place = f"{at}.params.{key}" if key is not None else at
            more = "" if key == fault.key else f"{fault.key}: "
            yield place, f"{more}{fault.rule}"


def _start_faults(design: StudyDesign, key: str, own: Rig, rig: Rig) -> Iterator[tuple[str, str]]:
    """Yield parameters that cannot change while a head runs from condition to condition."""
    one = design.conditions[key]
    if one.rig is not None or design.presentation.on == "film":
        return
    for name in _differences(own, rig):
        when = effect_time(name)
        if not when.startswith(NEXT_START):
            continue
        given = next((k for k in one.params if f"{name}.".startswith(f"{k}.")), None)
        named = "character" if one.character is not None else "profile"
        place = f"params.{given}" if given is not None else named
        reason = when.removeprefix(NEXT_START).lstrip(": ")
        yield (
            f"conditions.{key}.{place}",
            f"{name} cannot change while the head runs ({reason}): give the condition a rig of its "
            "own, or show films (presentation.on: film)",
        )


def _show_same(design: StudyDesign, rigs: Mapping[str, Rig], key: str, other: str) -> bool:
    """Return whether two conditions show the same gaze."""
    one, two = design.conditions[key], design.conditions[other]
    files = [(c.recording, c.film) for c in (one, two)]
    if any(file is not None for pair in files for file in pair):
        return files[0] == files[1]
    planned = [c.behaviour == PLANNED for c in (one, two)]
    return planned[0] == planned[1] and not _differences(rigs[key], rigs[other])


def _faults_at_key(key: str, error: ConfigError) -> Iterator[tuple[str, str]]:
    """Yield the faults of a file that a key names; for an unknown shipped name, the rule."""
    for fault in error.faults:
        yield key, fault.rule if fault.file.startswith("config/") else str(fault)


def load_checked_study(name_or_path: str) -> LoadedStudy:
    """Return a study by shipped name or path, with every rule checked.

    Raises:
        gazerig.config.load.ConfigError: with every fault.
    """
    return load_study(
        name_or_path, _surroundings, partial(objective_rules, known=BY_KEY), _recordings, _films
    )


def _surroundings(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield unknown scenes and worlds."""
    scene, world = design.presentation.scene, design.presentation.world
    known = scene_names()
    if scene is not None and scene not in known:
        near = suggestion_text(scene, known) or ";"
        yield "presentation.scene", f"no scene {scene!r}{near} there is {', '.join(known)}"
    worlds = surroundings_names()
    if world is not None and "/" not in world and "." not in world and world not in worlds:
        near = suggestion_text(world, worlds) or ";"
        there = ", ".join(worlds) or "none"
        yield "presentation.world", f"no world {world!r}{near} there is {there}"


def _recordings(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield recordings that the rig cannot repeat for a whole trial."""
    for key, one in design.conditions.items():
        if one.recording is None or not isfile(one.recording):
            continue
        try:
            run = RunRecording(one.recording)
            names = next(run.ticks()).guard_result.joints
            rig = load_rig(one.rig or design.presentation.rig)
        except ConfigError:
            continue  # reported at the rig
        except (BadRecording, StopIteration) as error:
            yield f"conditions.{key}.recording", str(error) or "holds no tick; record it again"
            continue
        if names != rig.names:
            other = ", ".join(sorted({*names} ^ {*rig.names}))
            rule = (
                f"is of a rig with other joints ({other}); name that rig, or record with this one"
            )
            yield f"conditions.{key}.recording", rule
        if run.duration_s < design.trials.seconds:
            rule = (
                f"lasts {run.duration_s:.1f} s, and a trial {design.trials.seconds:g} s: shorten "
                "trials.seconds, or record longer"
            )
            yield f"conditions.{key}.recording", rule


def _films(design: StudyDesign) -> Iterator[tuple[str, str]]:
    """Yield films that are too short for a presentation."""
    wanted_s = design.trials.seconds
    for key, one in design.conditions.items():
        if one.film is None or not isfile(one.film):
            continue
        try:
            seconds = film_seconds(one.film)
        except SetupError as error:
            yield f"conditions.{key}.film", str(error)
            continue
        if seconds < WHOLE_SHARE * wanted_s:
            rule = (
                f"lasts {seconds:.1f} s, and a trial {wanted_s:g} s: shorten trials.seconds, or "
                "take a longer film"
            )
            yield f"conditions.{key}.film", rule
