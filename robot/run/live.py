"""Parameters of a running rig: present values, changes and files.

A user's changes stay over the files until they are saved, also after a change of the character. All
methods may be called from any thread. Changes are checked together, and then reach the running
parts as one command.
"""

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import datetime
from pathlib import Path

from gazerig.config.load import find_file, shipped_names
from gazerig.config.parameters import (
    LIVE_LIMITS,
    AllowedFolder,
    apply_changes,
    differences,
    parameters,
    start_note,
    value_of,
    values,
)
from gazerig.config.rig import Rig
from gazerig.config.save import RigLayers, format_value, save_layers
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
        self._command, self._now, self._layers = command, now, layers
        self._lock = threading.RLock()
        self._options = differences(load_rig(*layers), rig)
        if layers.character is not None:
            rig = replace(rig, character=_character(layers.character))
        # The rig of the files, that with the present character, and that with all changes.
        self._saved = self._base = self._rig = self._started = rig
        self._defaults = load_rig(rig.name if rig.name in shipped_names("rigs") else "desk")
        self.version = 0
        self.confined = AllowedFolder(rig_folder(layers.name))

    @property
    def path(self) -> Path:
        """Return the rig's file."""
        return find_file("rigs", self._layers.name)

    @property
    def character(self) -> str:
        """Return the present character, "none" without one."""
        return self._rig.character or NO_CHARACTER

    def characters(self) -> tuple[str, ...]:
        """Return the known characters, the present one first; "none" is the rig itself."""
        now = self.character
        return (now, *(n for n in (NO_CHARACTER, *shipped_names("characters")) if n != now))

    def parameters(self, prefix: str = "") -> tuple[Parameter, ...]:
        """Return the parameters whose keys have a prefix, in the order of the file."""
        every = parameters(self._rig, self._defaults)
        return tuple(one for one in every if one.key.startswith(prefix))

    def get(self, prefix: str = "") -> dict[str, Value]:
        """Return the present values whose keys have a prefix.

        Raises:
            gazerig.config.load.ConfigError: no key matches; the message lists similar keys.
        """
        rig = self._rig
        found = {key: value for key, value in values(rig).items() if key.startswith(prefix)}
        return found or {prefix: value_of(rig, prefix)}

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply values at dotted keys from the next tick on, all of them or none.

        Returns a line for each changed value.

        Raises:
            gazerig.config.load.ConfigError: lists every fault; nothing changes.
        """
        with self._lock:
            base, wanted = self._base, {**differences(self._base, self._rig), **changes}
            if "character" in changes:
                wanted["character"] = name = _character(changes["character"])
                layers = self._layers._replace(character=name or NO_CHARACTER)
                base = apply_changes(load_rig(*layers), {**self._options, "character": name})
            return self._apply(base, apply_changes(base, wanted))

    def unsaved(self) -> tuple[ParamChange, ...]:
        """Return the present values that differ from the files."""
        with self._lock:
            was = values(self._saved)
            return tuple(
                ParamChange(key, format_value(was[key]) if key in was else None, format_value(new))
                for key, new in self._unsaved().items()
            )

    def revert(self) -> tuple[str, ...]:
        """Apply the values in the files again."""
        with self._lock:
            return self._apply(self._saved, self._saved)

    def save(self, path: Path | str | None = None) -> SavedFile:
        """Write the present values into the rig's file, or into a copy of it at a new path.

        From then on the copy is this rig's file. Other values that were edited in the file stay
        there for the next start.

        Raises:
            gazerig.config.load.ConfigError: the rig is a shipped one and no path is given, the path
                exists or cannot be written, the file has faults now, or another layer overrides a
                value.
        """
        with self._lock:
            copied = path is not None and os.path.realpath(path) != os.path.realpath(self.path)
            wanted, layers = self._unsaved(), self._layers
            if "character" in wanted:
                layers = layers._replace(character=None)
            saved = save_layers(layers, str(path) if copied else None, wanted, self._now())
            self._layers = layers._replace(name=str(path)) if copied else layers
            self._saved = self._base = self._rig
            self.version += 1
            return saved

    def _unsaved(self) -> dict[str, Value]:
        changed = differences(self._base, self._rig)
        if self._rig.character != self._saved.character:
            changed = {"character": self._rig.character, **changed}
        return changed

    def _apply(self, base: Rig, rig: Rig) -> tuple[str, ...]:
        """Apply a checked rig, and return the changes."""
        changed = differences(self._rig, rig)
        walk = rig.gaze.scanpath.transition_matrix
        if walk != self._rig.gaze.scanpath.transition_matrix:
            load_walk(walk)  # refused here rather than in the tick
        effect = differences(*(rig_in_effect(self._started, one) for one in (self._rig, rig)))
        if effect:
            self._command(Tune(tuple(effect.items())))
        self._base, self._rig = base, rig
        self.version += bool(changed)
        return tuple(f"{k} = {format_value(v)}{start_note(k)}" for k, v in changed.items())


def _character(name: Value) -> str | None:
    """Return the value of the key: None instead of "none"."""
    return None if name in (NO_CHARACTER, "", None) else str(name)
