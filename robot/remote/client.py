"""Client of a rig that runs in another program of the same user.

from gazerig.robot.remote.client import RobotClient

with RobotClient.connect() as rig:
    rig.set("gaze.lids.blinks_per_min", 12.0)
    print(rig.look_at(1.0, 0.3, 0.0).text())
    print(rig.status()["target"])
    rig.save("/home/me/my.yaml")
"""

import os
import threading
from base64 import b64encode
from collections.abc import Callable, Mapping
from functools import partial
from math import radians
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.errors import HeadEnded, NotFound, Refused
from gazerig.robot.model.command_json import as_json, check_command
from gazerig.robot.model.commands import (
    HEARTBEAT_S,
    Ask,
    Command,
    ControlCommand,
    Express,
    Jog,
    LookAt,
    Play,
    Renew,
    Resume,
    Say,
    SetLevel,
    Stop,
    SyncTrack,
    Talk,
    Value,
)
from gazerig.robot.model.parameter import JsonValue, ParamChange, Parameter, SavedFile
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.remote.socket_io import (
    ANSWER_BYTES,
    VERSION,
    MalformedMessage,
    Wire,
    connect_to_socket,
    find_sockets,
    is_private,
    socket_folder,
)

if TYPE_CHECKING:
    from gazerig.robot.control.head_state import HeadEvent, HeadState

CONNECT_S = 1.0
_ANSWER_S = 10.0
_FILES_S = 40.0
"""Timeout of requests that read or write files, which another process of the rig does, s."""
_WITH_FILES = {"save", "character", "say"}


class NoRobotError(SetupError, NotFound):
    """No rig runs, or not the requested one; the message lists those that run."""


class RequestRejected(SetupError, Refused):
    """The rig refused a request and is unchanged; the message lists every broken rule.

    Attributes:
        reply: Reply of the head to a command; None if the request was not a command.
    """

    def __init__(self, message: str, reply: CommandReply | None = None) -> None:
        super().__init__(message)
        self.reply = reply


class ConnectionLost(DriverError, HeadEnded):
    """The rig ended or does not answer; the message names the reason."""


class ClientConnection:
    """Client end of a connection to one rig; may be used from several threads.

    Args:
        wire: Connection.
        pid: Process id of the rig.
        ending: Called before the connection is closed.
    """

    def __init__(self, wire: Wire, pid: int, ending: Callable[[], None]) -> None:
        self._wire, self.pid, self._ending = wire, pid, ending
        self._lock = threading.Lock()
        self._greeted = False

    @property
    def is_busy(self) -> bool:
        """Return whether a request waits for its answer."""
        return self._lock.locked()

    def close(self) -> None:
        """Close the connection."""
        self._ending()
        self._wire.close()

    def ask(self, do: str, **fields: object) -> object:
        """Send a request and return its result.

        Raises:
            RequestRejected: a rule forbids it.
            ConnectionLost: the rig has ended, does not answer, or failed with an internal error.
        """
        with self._lock:
            if not self._greeted and do != "stop":  # nothing may delay or refuse a stop
                greeting = {"do": "hello", "version": VERSION}
                self._result(self._answer(greeting, _ANSWER_S))
                self._greeted = True
            answer = self._answer(
                {"do": do, **fields}, _FILES_S if do in _WITH_FILES else _ANSWER_S
            )
        return self._result(answer)

    def _result(self, answer: object) -> object:
        """Return the result in an answer, or raise the error in it."""
        match answer:
            case {"ok": said}:
                return said
            case {"refused": str(rules), "reply": dict(reply)}:
                raise RequestRejected(rules, CommandReply.from_json(reply))
            case {"refused": str(rules)}:
                raise RequestRejected(rules)
            case {"failed": str(what)}:
                raise ConnectionLost(f"the rig (process {self.pid}) had an internal error: {what}")
        raise ConnectionLost(f"process {self.pid} did not answer like a rig: {answer!r:.80}")

    def _answer(self, request: dict[str, object], within_s: float) -> object:
        try:
            self._wire.write(request, CONNECT_S)
        except (TypeError, ValueError) as error:
            raise RequestRejected(
                f"only finite numbers, text, lists and mappings can be sent: {error}"
            ) from None
        except OSError:
            raise ConnectionLost(
                f"the rig (process {self.pid}) has ended or disconnected"
            ) from None
        try:
            return self._wire.read(within_s, within_s)
        except TimeoutError:
            self.close()  # a late answer would be mistaken for that of the next request
            raise ConnectionLost(f"the rig (process {self.pid}) does not answer") from None
        except (EOFError, OSError):
            raise ConnectionLost(
                f"the rig (process {self.pid}) has ended or disconnected"
            ) from None
        except MalformedMessage as error:
            self.close()
            raise ConnectionLost(f"process {self.pid} did not answer like a rig: {error}") from None


_EVERY_S = 0.25 * HEARTBEAT_S


class ControlHeartbeat:
    """Renews manual control until another client takes it or it ends.

    Args:
        dial: Returns a new connection to the rig.
        who: Name of the client, as in the command that started the control.

    Raises:
        OSError: the connection failed.
    """

    def __init__(self, dial: Callable[[], Wire], who: str) -> None:
        self._wire = dial()
        self._request = as_json(Renew(who))
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
        self._thread.start()

    @property
    def in_control(self) -> bool:
        """Return whether the rig confirmed the last heartbeat."""
        return self._thread.is_alive() and not self._over.is_set()

    def end(self) -> None:
        """Stop the heartbeat."""
        self._over.set()
        self._wire.close()
        self._thread.join(timeout=2.0)

    def _beat(self) -> None:
        try:
            while not self._over.is_set():
                self._wire.write(self._request, HEARTBEAT_S)
                match self._wire.read(10.0, 10.0):
                    case {"ok": _}:
                        self._over.wait(_EVERY_S)
                    case _:  # another client is in control, or none
                        return
        except (OSError, EOFError, MalformedMessage):
            return  # closed by either side


class RobotClient:
    """Connection to one running rig; a call returns when the rig has executed it.

    Use ``connect`` to create one.

    Args:
        wire: Connection.
        pid: Process id of the rig.
        who: Name of this client in messages.
        dial: Opens another connection to the same rig.
    """

    def __init__(
        self, wire: Wire, pid: int, who: str = "", dial: Callable[[], Wire] | None = None
    ) -> None:
        self._connection = ClientConnection(wire, pid, self._end_heartbeat)
        self.who = who
        self._dial = dial
        self._heartbeat: ControlHeartbeat | None = None
        self._talks = False
        self.pid = pid

    @classmethod
    def connect(cls, which: int | str | None = None, who: str = "") -> "RobotClient":
        """Connect to the only rig that runs, or to that of a process or name.

        Args:
            which: Process id or name of the rig; None if only one runs.
            who: Name of this client in messages, e.g. "my show"; the process is added.

        Raises:
            NoRobotError: no rig runs, or not exactly one fits; the message lists those that run.
        """
        found = connect_to_all(which, who)
        if len(found) == 1:
            return found[0]
        for other in found:
            other.close()
        asked = "" if which is None else f" {_choice_text(which)}"
        there = _names(connect_to_all())
        if not found:
            raise NoRobotError(
                f"no rig{asked} is running: {there or 'start one with gazerig run ...'}"
            )
        raise NoRobotError(
            f"{len(found)} rigs{asked} are running: {there}; choose one with --rig NAME or --pid N"
        )

    def __enter__(self) -> "RobotClient":
        """Return the connection itself."""
        return self

    def __exit__(self, *raised: object) -> None:
        """Disconnect."""
        self.close()

    def close(self) -> None:
        """Close the connection; the rig continues, and manual control without ``stay`` ends."""
        self._connection.close()

    def state(self, after: int = 0) -> "tuple[HeadState | None, tuple[HeadEvent, ...]]":
        """Return the newest tick, None before the first, and events numbered above ``after``."""
        said = cast(dict[str, Any], self._connection.ask("state", after=after))
        # Imported here, because ``gazerig stop`` must not wait for NumPy.
        from gazerig.robot.control.head_state import HeadEvent, from_json

        events = tuple(HeadEvent(**one) for one in said["events"])
        return (from_json(said["state"]) if said["state"] else None), events

    def status(self) -> dict[str, Any]:
        """Return the rig's status: name, target, reason, guard level, joints, last messages."""
        return cast(dict[str, Any], self._connection.ask("status"))

    @property
    def name(self) -> str:
        """Return the name of the rig (``gazerig run --name``)."""
        now = self.status()
        return str(now.get("name") or rig_name(now["rig"]))

    def get(self, prefix: str = "") -> dict[str, JsonValue]:
        """Return the present values of all keys that start with ``prefix``."""
        return cast(dict[str, JsonValue], self._connection.ask("get", prefix=prefix))

    def parameters(self, prefix: str = "") -> tuple[Parameter, ...]:
        """Return the rules and defaults of all keys that start with ``prefix``."""
        found = cast(list[dict[str, Any]], self._connection.ask("parameters", prefix=prefix))
        return tuple(Parameter.from_json(one) for one in found)

    def parameter(self, key: str) -> Parameter:
        """Return one parameter's rule and default.

        Raises:
            RequestRejected: there is no such key.
        """
        for found in self.parameters(key):
            if found.key == key:
                return found
        raise RequestRejected(f"{key}: unknown key; gazerig ctl get lists all")

    def set(self, key: str, value: Value) -> tuple[str, ...]:
        """Apply a value, which the loop uses when this returns; return notes for the user.

        Raises:
            RequestRejected: the value breaks a rule; nothing was changed.
        """
        return self.set_many({key: value})

    def set_many(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply several values in the same tick, or none of them.

        Raises:
            RequestRejected: a value breaks a rule; the message lists every broken rule.
        """
        return self._notes(self._connection.ask("set", changes=dict(changes)))

    def unsaved(self) -> tuple[ParamChange, ...]:
        """Return the present values that differ from the rig's file."""
        return _changes(self._connection.ask("unsaved"))

    def changed_from_defaults(self) -> tuple[ParamChange, ...]:
        """Return the present values that differ from the defaults."""
        return _changes(self._connection.ask("differs"))

    def save(self, path: Path | str | None = None) -> SavedFile:
        """Write the present values to the rig's own file, or to another file on this computer.

        Raises:
            RequestRejected: the file cannot be written, or is shipped with the program.
        """
        whole = None if path is None else str(Path(path).expanduser().absolute())
        said = cast(dict[str, Any], self._connection.ask("save", path=whole))
        backup = None if said["backup"] is None else Path(said["backup"])
        return SavedFile(Path(said["path"]), backup, _changes(said["changes"]))

    def revert(self) -> tuple[str, ...]:
        """Apply the values of the rig's file again."""
        return self._notes(self._connection.ask("revert"))

    def characters(self) -> tuple[str, ...]:
        """Return the names of the characters that can be applied to the rig."""
        return tuple(cast(list[str], self._connection.ask("characters")))

    def apply_character(self, name: str) -> tuple[str, ...]:
        """Apply another character to the rig.

        Raises:
            RequestRejected: there is no such character.
        """
        return self._notes(self._connection.ask("character", name=name))

    def menus(self) -> dict[str, tuple[str, ...]]:
        """Return the arguments of ``ask``: menu -> choices, the present one first."""
        said = cast(dict[str, list[str]], self._connection.ask("menus"))
        return {menu: tuple(choices) for menu, choices in said.items()}

    def ask(self, menu: str, choice: str) -> None:
        """Choose a behaviour, a mode of conversation, or a lid movement.

        Raises:
            RequestRejected: there is no such menu or choice.
        """
        self._command(Ask(menu, choice))

    def express(self, expression: str, strength: float = 1.0) -> None:
        """Move to a facial expression of the rig's table; strength 0..1.

        Raises:
            RequestRejected: there is no such expression; the message lists all.
        """
        self._command(Express(expression, strength))

    def set_level(self, level: str, value: float) -> None:
        """Set a level of the rig's table, 0..1; without a new value for .5 s it falls to 0.

        Raises:
            RequestRejected: there is no such level; the message lists all.
        """
        self._command(SetLevel(level, value))

    def play(
        self, track: str, speed: float = 1.0, times: int = 0, from_s: float | str = 0.0,
        loop: bool = False,
    ) -> CommandReply:  # fmt: skip
        """Play a track; "" ends all tracks.

        Args:
            track: Name of the track.
            speed: Factor on the track's own speed.
            times: Number of repetitions; 0: as the track defines.
            from_s: Position, in s or as the name of a cue, at which it begins.
            loop: Whether it repeats until it is ended.

        Returns:
            Reply whose ``track`` has the duration and the reductions by the rig's limits.

        Raises:
            RequestRejected: there is no such track, this rig cannot do it, the joints are under
                manual control or the rig is stopped.
        """
        return self._command(Play(track, speed, times, self.who, from_s, loop))

    def sync_track(self, number: int, position_s: float) -> None:
        """Give the position of a track by another clock, at most some ten times per second."""
        self._command(SyncTrack(number, position_s))

    def say(self, what: str, volume: float = 1.0, sway: bool = True) -> CommandReply:
        """Say a sound file, by its ending, or a text; return when it begins.

        Raises:
            RequestRejected: it cannot be said; the message names the file or program.
        """
        return self._command(Say(what, volume, sway, (), self.who))

    def say_piece(
        self, pcm: bytes, rate_hz: int, channels: int = 1, last: bool = False, volume: float = 1.0
    ) -> float:
        """Say a piece of a stream; return the length that has not been heard, s.

        Args:
            pcm: Samples, signed, 16 bits, channels interleaved.
            rate_hz: Rate of the stream.
            channels: 1 or 2.
            last: Whether it is the last piece.
            volume: Factor 0..1 of the first piece; 0: only the mouth moves.

        Raises:
            RequestRejected: too much is waiting, or nothing can be played.
        """
        said = self._connection.ask(
            "say_piece",
            pcm=b64encode(pcm).decode(),
            rate_hz=rate_hz,
            channels=channels,
            last=last,
            volume=volume,
        )
        return float(cast(float, said))

    def tracks(self) -> tuple[dict[str, Any], ...]:
        """Return all tracks: name, description, duration_s, slowed_by, refused (if it is)."""
        return tuple(cast(list[dict[str, Any]], self._connection.ask("tracks")))

    def look_at(self, x_m: float, y_m: float, z_m: float, stay: bool = False) -> CommandReply:
        """Look at a point in the frame of the neck base: x ahead, y left, z up, m.

        Args:
            x_m: Distance ahead, m.
            y_m: Distance to the left, m.
            z_m: Height, m.
            stay: Whether the control lasts until it is ended; otherwise it also ends with this
                connection or program, or when another client takes over.

        Returns:
            Reply with the distance between the reachable gaze and the point, and the joints at
            their limits.

        Raises:
            RequestRejected: a coordinate is not finite, or the rig is stopped.
        """
        return self.send(LookAt((x_m, y_m, z_m), self.who, stay))

    def fault(self, text: str) -> str:
        """Execute a fault command of the emulated servos; return a description of it.

        Args:
            text: Command of ``gazerig emulate``, e.g. "lose 3 count 2" or "push head 5 left".

        Raises:
            RequestRejected: there is no such command, or the servos are real.
        """
        return str(self._connection.ask("fault", text=text))

    def look_freely(self) -> None:
        """Let the head choose its targets again."""
        self.send(LookAt(None, self.who))

    def jog(self, joint: str, deg: float, stay: bool = False) -> CommandReply:
        """Hold all joints and move one to an angle.

        Args:
            joint: Name of the joint.
            deg: Angle, deg.
            stay: As in ``look_at``.

        Raises:
            RequestRejected: there is no such joint, the angle is outside its range, or the rig is
                stopped.
        """
        return self.send(Jog(((joint, radians(deg)),), self.who, stay))

    def jog_free(self) -> None:
        """Return the joints to the gaze models."""
        self._command(Jog((), self.who))

    @property
    def in_control(self) -> bool:
        """Return whether this connection renews a manual control that the rig still follows."""
        return self._heartbeat is not None and self._heartbeat.in_control

    def send(self, command: Command) -> CommandReply:
        """Send any command; control and conversation without ``stay`` are renewed from now on.

        Raises:
            RequestRejected: the command is not valid, or the head refuses it.
        """
        if command == LookAt(None, self.who) and not self._talks:
            self._end_heartbeat()
        reply = self._command(command)
        if isinstance(command, Talk):
            # After idle the heartbeat ends by itself, unless the client controls the gaze too.
            self._talks = command.state != "idle" and not command.stay
            if not self._talks or self._dial is None:
                return reply
        elif not isinstance(command, ControlCommand) or not reply.control_number:
            return reply
        elif (command.stay and not self._talks) or self._dial is None:
            self._end_heartbeat()
            return reply
        if not self.in_control:
            self._end_heartbeat()
            try:
                self._heartbeat = ControlHeartbeat(self._dial, self.who)
            except OSError:
                raise ConnectionLost(
                    f"the rig (process {self.pid}) has ended or disconnected"
                ) from None
        return reply

    def _end_heartbeat(self) -> None:
        heartbeat, self._heartbeat = self._heartbeat, None
        if heartbeat is not None:
            heartbeat.end()

    def stop(self, why: str = "requested by another program") -> None:
        """Switch the torque off immediately; when this returns, the loop has done it.

        Raises:
            ConnectionLost, RequestRejected: it may not have stopped: press the emergency stop.
        """
        self._command(Stop(why, self.who))

    def resume(self, confirmed: bool = False) -> None:
        """Switch the torque on at the present angles, and continue slowly.

        Args:
            confirmed: Whether a person has confirmed that no hand is in the mechanism; needed if
                another client stopped the rig.

        Raises:
            RequestRejected: a servo or a rule of stops refuses it; the torque stays off.
        """
        self._command(Resume(self.who, confirmed))

    def _command(self, command: Command) -> CommandReply:
        try:
            check_command(command)
        except ValueError as error:
            raise RequestRejected(str(error)) from None
        if isinstance(command, Stop) and self._connection.is_busy and self._dial is not None:
            return self._stop_at_once(command, self._dial)
        fields = as_json(command)
        said = self._connection.ask(str(fields.pop("do")), **fields)
        match said:
            case {"reply": dict(reply)}:
                return CommandReply.from_json(reply)
        return CommandReply()

    def _stop_at_once(self, command: Stop, dial: Callable[[], Wire]) -> CommandReply:
        """Stop over another connection: a thread waits on this one, e.g. until a text is spoken."""
        try:
            wire = dial()
        except OSError:
            raise ConnectionLost(
                f"the rig (process {self.pid}) has ended or disconnected"
            ) from None
        with RobotClient(wire, self.pid, self.who) as other:
            return other.send(command)

    def _notes(self, said: object) -> tuple[str, ...]:
        return tuple(cast(dict[str, list[str]], said)["notes"])


def connect_to_all(which: int | str | None = None, who: str = "") -> list[RobotClient]:
    """Connect to every rig of this user that runs, or to those of one process or name.

    Args:
        which: Process id or name of the rig; None: all.
        who: As in ``RobotClient.connect``.
    """
    if isinstance(which, str) and not which.isdecimal():
        return _select_by_name(connect_to_all(who=who), which)
    pid = None if which is None else int(which)
    uid = os.getuid()
    place = socket_folder(os.environ, uid)
    if not is_private(place, uid):  # any user may have put a socket there
        return []
    found: list[RobotClient] = []
    for path, number in find_sockets(place).items():
        if pid is None or number == pid:
            try:
                found.append(
                    RobotClient(_connect_wire(path), number, who, partial(_connect_wire, path))
                )
            except OSError:  # killed: the next rig that starts removes it
                continue
    return found


def _connect_wire(path: Path) -> Wire:
    """Connect to a rig's socket."""
    return Wire(connect_to_socket(path, CONNECT_S), ANSWER_BYTES)


def rig_name(rig: str) -> str:
    """Return the name of an unnamed rig: that of its file."""
    return Path(rig).stem


def _choice_text(which: int | str) -> str:
    """Return a chosen process or name as text."""
    return f"of process {which}" if str(which).isdecimal() else f"named {which}"


def _select_by_name(rigs: list[RobotClient], name: str) -> list[RobotClient]:
    """Return the rigs of a name, and close the other connections."""
    found = []
    for rig in rigs:
        try:
            named = rig.name == name
        except DriverError:  # it is ending or hangs
            named = False
        if named:
            found.append(rig)
        else:
            rig.close()
    return found


def _names(rigs: list[RobotClient]) -> str:
    """Return the names and processes of rigs as text, and close the connections."""
    names = []
    for rig in rigs:
        with rig:
            try:
                names.append(f"{rig.name} (process {rig.pid})")
            except DriverError as error:
                names.append(f"process {rig.pid} ({error})")
    return ", ".join(sorted(names))


def _changes(rows: object) -> tuple[ParamChange, ...]:
    """Return the changes that a rig's answer lists."""
    return tuple(
        ParamChange(row["key"], row["old"], row["new"]) for row in cast(list[dict[str, Any]], rows)
    )
