"""Parameters of a running rig: present values, changes and files.

There are three rigs: that of the files (with the options of the command line), the present one, and
that of the defaults. A user's changes override the files until they are saved, also after a change
of the character or of the files.

All methods may be called from any thread. Changes are checked together, and then reach the running
parts as one command.
"""

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import NamedTuple

from gazerig.config.load import find_file, shipped_names
from gazerig.config.parameters import (
    LIVE_LIMITS,
    apply_changes,
    differences,
    parameters,
    start_note,
    value_of,
    values,
)
from gazerig.config.rig import Rig
from gazerig.config.rig_files import AllowedFolder, RigLayers, save_layers
from gazerig.config.save_text import format_value
from gazerig.config.schema import NO_CHARACTER, load_rig, load_walk
from gazerig.config.shipped_files import is_path
from gazerig.robot.model.commands import Tune, Value
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import CommandTaker


def rig_in_effect(running: Rig, wanted: Rig) -> Rig:
    """Return a running rig with those values of another that it applies before its next start."""
    joints = {
        name: replace(joint, **{key: getattr(wanted.joints[name], key) for key in LIVE_LIMITS})
        for name, joint in running.joints.items()
        if name in wanted.joints
    }
    return replace(
        running,
        character=wanted.character,
        ranges=wanted.ranges,
        gaze=replace(wanted.gaze, chooser=running.gaze.chooser, plugins=running.gaze.plugins),
        guard=wanted.guard,
        sound=replace(running.sound, device=wanted.sound.device),
        joints={**running.joints, **joints},
    )


def rig_folder(name: str) -> Path:
    """Return the folder of a user's rig, for a shipped one the working folder."""
    return find_file("rigs", name).parent if is_path(name) else Path.cwd()


class _Rigs(NamedTuple):
    """State at one moment, replaced as a whole.

    saved: rig of the files, with the options; rig: the present one
    in_effect: the one that the running parts have
    layers: requested files
    """

    saved: Rig
    rig: Rig
    in_effect: Rig
    layers: RigLayers

    @property
    def present_layers(self) -> RigLayers:
        """Return the files with the present character, which may be unsaved."""
        chosen = self.rig.character
        if chosen == self.saved.character:
            return self.layers
        return self.layers._replace(character=chosen or NO_CHARACTER)


class ParamStore:
    """Parameters of one running rig.

    version: increases with each change
    confined: files that a user of the page may name

    Args:
        rig: The rig as it was started; options of the command line override its files.
        command: Queues commands for the next tick, as gazerig.robot.loop.loop.Robot.command.
        layers: Requested files of the rig.
        now: Returns the time for the name of a backup.

    Raises:
        gazerig.config.load.ConfigError: the files have changed meanwhile and are now invalid.
    """

    def __init__(
        self,
        rig: Rig,
        command: CommandTaker,
        layers: RigLayers,
        now: Callable[[], datetime] = datetime.now,
    ) -> None:
        self._command, self._now = command, now
        self._changing = threading.Lock()
        self._options = differences(load_rig(*layers), rig)
        self._rigs = _Rigs(rig, rig, rig, layers)
        self._defaults = load_rig(rig.name if rig.name in shipped_names("rigs") else "desk")
        self.version = 0
        self.confined = AllowedFolder(rig_folder(layers.name))

    @property
    def path(self) -> Path:
        """Return the rig's file."""
        return find_file("rigs", self._rigs.layers.name)

    @property
    def character_name(self) -> str:
        """Return the present character, "none" without one."""
        rigs = self._rigs
        return rigs.present_layers.character or rigs.rig.character or NO_CHARACTER

    def parameters(self) -> tuple[Parameter, ...]:
        """Return all parameters in the order of the file."""
        return parameters(self._rigs.rig, self._defaults)

    def values(self) -> dict[str, Value]:
        """Return the present value of every parameter, by key."""
        return values(self._rigs.rig)

    def get(self, prefix: str = "") -> dict[str, Value]:
        """Return the present values whose keys have a prefix.

        Raises:
            gazerig.config.load.ConfigError: no key matches; the message lists similar keys.
        """
        rig = self._rigs.rig
        found = {key: value for key, value in values(rig).items() if key.startswith(prefix)}
        return found or {prefix: value_of(rig, prefix)}

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply values at dotted keys from the next tick on, all of them or none.

        Returns a line for each changed value.

        Raises:
            gazerig.config.load.ConfigError: lists every fault; nothing changes.
        """
        with self._changing:
            before = self._rigs
            rig = apply_changes(before.rig, changes)
            if "character" not in changes:
                return self._apply(before, rig)
            layers = before.layers
            if rig.character == before.saved.character:  # the file's replaces the option
                layers = layers._replace(character=None)
            state = _read(before._replace(rig=rig, layers=layers), self._options)
            unsaved = {**differences(before.saved, rig), **changes}
            return self._apply(state, apply_changes(state.saved, unsaved))

    def unsaved(self) -> tuple[ParamChange, ...]:
        """Return the present values that differ from the files."""
        rigs = self._rigs
        was = values(rigs.saved)
        return tuple(
            ParamChange(key, format_value(was[key]) if key in was else None, format_value(value))
            for key, value in differences(rigs.saved, rigs.rig).items()
        )

    def revert(self) -> tuple[str, ...]:
        """Apply the values in the files again.

        Raises:
            gazerig.config.load.ConfigError: the files that are read without an unsaved character
                have become invalid.
        """
        with self._changing:
            rigs = self._rigs
            if rigs.rig.character != rigs.saved.character:
                rigs = _read(rigs._replace(rig=rigs.saved), self._options)
            return self._apply(rigs, rigs.saved)

    def save(self, path: Path | str | None = None) -> SavedFile:
        """Write the present values into the rig's file, or into a copy of it at a new path.

        From then on the copy is this rig's file. Edits of the file that are not applied yet are
        included.

        Raises:
            gazerig.config.load.ConfigError: the rig is a shipped one and no path is given, the path
                exists or cannot be written, the file has faults now, or another layer overrides a
                value.
        """
        with self._changing:
            copied = path is not None and os.path.realpath(path) != os.path.realpath(self.path)
            self._reload()
            rigs, to = self._rigs, str(path) if copied else None
            wanted = differences(rigs.saved, rigs.rig)
            saved = save_layers(rigs.present_layers, to, wanted, self._now())
            layers = rigs.layers._replace(name=to or rigs.layers.name)
            if "character" in wanted:
                layers = layers._replace(character=None)
            self._rigs = rigs._replace(saved=rigs.rig, layers=layers)
            self.version += 1
            return saved

    def characters(self) -> tuple[str, ...]:
        """Return the known characters, the present one first; "none" is the rig itself."""
        now = self.character_name
        return (now, *(n for n in (NO_CHARACTER, *shipped_names("characters")) if n != now))

    def apply_character(self, name: str) -> tuple[str, ...]:
        """Apply another character to the rig; unsaved values override both.

        name: name of a shipped character, a path, or "none"

        Raises:
            gazerig.config.load.ConfigError: the character is unknown, or does not fit the rig.
        """
        return self.set({"character": None if name in (NO_CHARACTER, "") else name})

    def _reload(self) -> None:
        """Read the files again; unsaved values stay unless the files changed them."""
        before = self._rigs
        rigs = _read(before, self._options)
        edited = differences(before.saved, rigs.saved)
        if "character" in edited and before.rig.character != before.saved.character:
            rigs = _read(before._replace(rig=before.saved), self._options)
        kept = {
            key: value
            for key, value in differences(before.saved, before.rig).items()
            if key not in edited
        }
        self._apply(rigs, apply_changes(rigs.saved, kept))

    def _apply(self, rigs: _Rigs, rig: Rig) -> tuple[str, ...]:
        """Apply a checked rig, and return the changes."""
        before = self._rigs
        found = differences(before.rig, rig)
        if not found and rigs == before:
            return ()
        in_effect = rig_in_effect(before.in_effect, rig)
        walk = in_effect.gaze.scanpath.transition_matrix
        if walk != before.in_effect.gaze.scanpath.transition_matrix:
            load_walk(walk)  # refused here rather than in the tick
        if in_effect != before.in_effect:
            self._command(Tune(tuple(differences(before.in_effect, in_effect).items())))
        self._rigs = rigs._replace(rig=rig, in_effect=in_effect)
        self.version += 1
        return tuple(f"{k} = {format_value(v)}{start_note(k)}" for k, v in found.items())


def _read(rigs: _Rigs, options: Mapping[str, Value]) -> _Rigs:
    """Return the state with the files' present values under the options; the rig stays."""
    return rigs._replace(saved=apply_changes(load_rig(*rigs.present_layers), options))
