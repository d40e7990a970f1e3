"""Store of a running rig's parameters: present values, changes and files.

There are three rigs: that of the files (with the options of the command line), the present one, and
that of the defaults. A user's changes override the files until they are saved, also after a change
of the character or of the files.

All methods may be called from any thread. Changes are checked together, and then reach the running
parts as one command.
"""

import os
import threading
from collections.abc import Callable, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any, NamedTuple

from gazerig.config.load import find_file, shipped_names
from gazerig.config.parameters import (
    apply_changes,
    differences,
    start_note,
    value_of,
    values,
)
from gazerig.config.parameters import parameters as described
from gazerig.config.rig import Rig
from gazerig.config.rig_files import AllowedFolder, RigLayers, read_all, save_layers
from gazerig.config.save_text import format_value
from gazerig.config.schema import NO_CHARACTER, load_rig
from gazerig.robot.model.commands import Value
from gazerig.robot.model.parameter import ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import CommandTaker
from gazerig.robot.run.live_params import LiveParams, rig_in_effect
from gazerig.robot.run.subprocess_call import in_subprocess

_DEFAULTS = "desk"


class _RigState(NamedTuple):
    """State at one moment, replaced as a whole.

    saved: rig of the files, with the options; rig: the present one
    in_effect: the one that the running parts have
    name: the given name or path of the rig
    character: the command line's character; None: the rig's
    files: present files
    file_values, values: values of ``saved`` and of ``rig``, by key
    """

    saved: Rig
    rig: Rig
    in_effect: Rig
    name: str
    character: str | None
    files: tuple[Path, ...]
    file_values: Mapping[str, Value]
    values: Mapping[str, Value]
    version: int


class ParamStore:
    """Store of one running rig's parameters.

    version: increases with each change
    confined: files that a user of the page may name

    Args:
        live_params: the parameters of the assembled rig.
        command: queues commands for the next tick, as gazerig.robot.loop.loop.Robot.command.
        rig: name or path of the rig.
        character: name or path of the character.
        profile: name or path of the profile.
        now: Returns the time for the name of a backup.
        elsewhere: calls a function that reads or writes rig files in another process, so that
            the control loop is not delayed.

    Raises:
        gazerig.config.load.ConfigError: the files have changed meanwhile and are now invalid.
    """

    def __init__(
        self,
        live_params: LiveParams,
        command: CommandTaker,
        rig: str,
        character: str | None = None,
        profile: str | None = None,
        now: Callable[[], datetime] = datetime.now,
        elsewhere: Callable[..., Any] = in_subprocess,
    ) -> None:
        self._live_params, self._command = live_params, command
        self._profile, self._now, self._elsewhere = profile, now, elsewhere
        self._changing = threading.Lock()
        self._defaults = _defaults(live_params.rig)
        # Options of the command line override the files.
        read, files = read_all(RigLayers(rig, character, profile))
        whole, found = live_params.rig, values(live_params.rig)
        self._options = differences(read, whole)
        self._state = _RigState(whole, whole, whole, rig, character, files, found, found, 0)
        self._described = described(whole, self._defaults)
        # The folder of a shipped rig belongs to the package and contains no user files.
        at_home = rig in shipped_names("rigs")
        self.confined = AllowedFolder(Path.cwd() if at_home else self.path.parent)

    @property
    def version(self) -> int:
        """Return the number of changes."""
        return self._state.version

    @property
    def name(self) -> str:
        """Return the rig's name or path."""
        return self._state.name

    @property
    def path(self) -> Path:
        """Return the rig's file."""
        return find_file("rigs", self._state.name)

    @property
    def character_name(self) -> str:
        """Return the present character, "none" without one."""
        return self._layers(self._state).character or self._state.rig.character or NO_CHARACTER

    def files(self) -> tuple[Path, ...]:
        """Return the files in use: the rig's, and those that override it."""
        return self._state.files

    def parameters(self) -> tuple[Parameter, ...]:
        """Return all parameters in the order of the file."""
        state, made = self._state, self._described
        # Everything stays except the set of entries.
        if [param.key for param in made] != list(state.values):
            made = self._described = described(state.rig, self._defaults)
        return made

    def values(self) -> dict[str, Value]:
        """Return the present value of every parameter, by key."""
        return dict(self._state.values)

    def get(self, prefix: str = "") -> dict[str, Value]:
        """Return the present values whose keys have a prefix.

        Raises:
            gazerig.config.load.ConfigError: no key matches; the message lists similar keys.
        """
        state = self._state
        found = {key: value for key, value in state.values.items() if key.startswith(prefix)}
        return found or {prefix: value_of(state.rig, prefix)}

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply values at dotted keys from the next tick on, all of them or none.

        Returns a line for each changed value.

        Raises:
            gazerig.config.load.ConfigError: lists every fault; nothing changes.
        """
        with self._changing:
            state = before = self._state
            rig = apply_changes(before.rig, changes)
            if "character" in changes:
                if rig.character == before.saved.character:  # the file's replaces the option
                    state = before._replace(character=None)
                state = self._read(state._replace(rig=rig))
                changes = {**differences(before.saved, rig), **changes}
                rig = apply_changes(state.saved, changes)
            return self._apply(state, rig)

    def unsaved(self) -> tuple[ParamChange, ...]:
        """Return the present values that differ from the files."""
        state = self._state
        return _changes(state.saved, state.rig, state.file_values)

    def revert(self) -> tuple[str, ...]:
        """Apply the values in the files again.

        Raises:
            gazerig.config.load.ConfigError: the character is another one, and the files that are
                read without it have become invalid.
        """
        with self._changing:
            state = self._state
            if state.rig.character != state.saved.character:
                state = self._read(state._replace(rig=state.saved))
            return self._apply(state, state.saved)

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
            state = self._state
            wanted = differences(state.saved, state.rig)
            to = str(path) if copied else None
            done = self._elsewhere(save_layers, self._layers(state), to, wanted, self._now())
            state = state._replace(name=to or state.name)
            saved: SavedFile
            saved, files = done
            if "character" in wanted:
                state = state._replace(character=None)
            self._state = state._replace(
                saved=state.rig, file_values=state.values, files=files, version=state.version + 1
            )
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

    def reload(self, path: Path | str | None = None) -> tuple[str, ...]:
        """Apply the present values of the files; unsaved values stay unless the files changed them.

        path: the edited file

        Raises:
            gazerig.config.load.ConfigError: lists every fault; nothing changes.
        """
        with self._changing:
            return self._reload()

    def _reload(self) -> tuple[str, ...]:
        before, state = self._state, self._read(self._state)
        edited = differences(before.saved, state.saved)
        if "character" in edited and before.rig.character != before.saved.character:
            state = self._read(before._replace(rig=before.saved))
        kept = {
            key: value
            for key, value in differences(before.saved, before.rig).items()
            if not any(
                f"{key}.".startswith(f"{other}.") or f"{other}.".startswith(f"{key}.")
                for other in edited
            )
        }
        return self._apply(state, apply_changes(state.saved, kept))

    def _layers(self, state: _RigState) -> RigLayers:
        chosen = state.rig.character
        unsaved = chosen != state.saved.character
        character = (chosen or NO_CHARACTER) if unsaved else state.character
        return RigLayers(state.name, character, self._profile)

    def _read(self, state: _RigState) -> _RigState:
        """Read the files and apply the options; the present rig does not change."""
        rig, files = self._elsewhere(read_all, self._layers(state))
        saved = apply_changes(rig, self._options)
        return state._replace(saved=saved, file_values=values(saved), files=files)

    def _apply(self, state: _RigState, rig: Rig) -> tuple[str, ...]:
        """Apply a checked rig, and return the changes."""
        before = self._state
        found = differences(before.rig, rig)
        if not found and state == before:
            return ()
        in_effect = rig_in_effect(before.in_effect, rig)
        if in_effect == before.in_effect:
            in_effect = before.in_effect
        else:
            self._command(self._live_params.prepare(before.in_effect, in_effect))
        self._state = state._replace(
            rig=rig if found else before.rig,
            in_effect=in_effect,
            values=values(rig) if found else before.values,
            version=before.version + 1,
        )
        return tuple(f"{k} = {format_value(v)}{start_note(k)}" for k, v in found.items())


def _defaults(rig: Rig) -> Rig:
    """Return the shipped rig of the same name, otherwise the base of all rigs."""
    return load_rig(rig.name if rig.name in shipped_names("rigs") else _DEFAULTS)


def _changes(before: Rig, after: Rig, was: Mapping[str, Value]) -> tuple[ParamChange, ...]:
    """Return each value that differs, as YAML; was: former values."""
    return tuple(
        ParamChange(key, format_value(was[key]) if key in was else None, format_value(value))
        for key, value in differences(before, after).items()
    )
