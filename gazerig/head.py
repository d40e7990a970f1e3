"""The interface of a head, whether it runs in this program or in another, and its orders."""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from math import radians
from pathlib import Path
from typing import Any, Literal, Self

from gazerig.drivers.sound.params import KINDS
from gazerig.errors import HeadEnded, Refused
from gazerig.gaze.attention.finding import Sought
from gazerig.robot.loop.head_state import (
    EventKind,
    GazeReading,
    HeadEvent,
    HeadState,
    JointReading,
    Person,
)
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    FAR_M,
    Ask,
    Command,
    EndTrack,
    Express,
    Find,
    Frame,
    Get,
    Jog,
    LookAt,
    LookAtDirection,
    LookAtPerson,
    LookAtPixel,
    MoveOpponent,
    Play,
    ReadMenus,
    ReadPicture,
    Request,
    Resume,
    Revert,
    Save,
    Say,
    SayPiece,
    Set,
    SetLevel,
    Stop,
    Talk,
    Value,
    as_value,
)
from gazerig.robot.model.parameter import SavedFile
from gazerig.robot.model.reply import CommandReply, Outcome, Progress, command_outcome

STREAM_AHEAD_S = 1.0
"""Length of a stream that is sent before it is heard."""
_ACCEPTS_S = 1.0
"""Time in which the head must accept an order."""


class Order:
    """An order to a head, as returned by ``look_at`` and similar methods.

    Args:
        host: the head.
        read_reply: returns the reply once the head has accepted the order, None before.
    """

    def __init__(self, host: "Head", read_reply: Callable[[], CommandReply | None]) -> None:
        self._host, self._read_reply = host, read_reply
        self._reply: CommandReply | None = None
        self._outcome: Outcome | None = None
        self._why = ""

    def __repr__(self) -> str:
        return f"<Order: {self._outcome or 'in progress'}>"

    @property
    def reply(self) -> CommandReply:
        """Return the head's reply; wait until it has accepted the order, a tick or two.

        Raises:
            HeadEnded: the head has ended, or does not respond.
        """
        reply = self._accepted_reply()
        if reply is None:
            self._host._pause(lambda: self._accepted_reply() is not None, _ACCEPTS_S)
            reply = self._accepted_reply()
        if reply is None:
            raise HeadEnded(f"the head has not accepted the order within {_ACCEPTS_S:g} s")
        return reply

    @property
    def refused(self) -> bool:
        """Return whether the head refused the order; ``why`` gives the reason."""
        return bool(self.reply.refused)

    @property
    def outcome(self) -> Outcome | None:
        """Return how the order ended, None while it is in progress."""
        if self._outcome is None:
            self._update_outcome(self._host._progress())
        return self._outcome

    @property
    def active(self) -> bool:
        """Return whether the order still controls gaze or joints."""
        reply, lead = self._accepted_reply(), self._host._progress().client_control
        return reply is not None and 0 < reply.control_number == lead.number and lead.active

    @property
    def why(self) -> str:
        """Return why the order was refused, taken over or out of reach, or who was found."""
        return self._why if self.outcome is not None else ""

    def wait(self, timeout_s: float | None = 10.0) -> Outcome:
        """Wait until the order has ended; step a head in simulated time until then.

        Args:
            timeout_s: seconds by the head's own clock; None: without limit.

        Raises:
            HeadEnded: the head has ended in the meantime.
        """
        longest_s = timeout_s if timeout_s is not None else threading.TIMEOUT_MAX
        self._host._pause(lambda: self.outcome is not None, longest_s)
        return self._outcome or "timed out"

    def end(self) -> None:
        """Give up control, if the order still has it."""
        if self.active:
            self._host.look_freely()

    def _update_outcome(self, now: Progress) -> bool:
        """Update from the newest owner and tracks; return whether the order has ended."""
        reply = self._accepted_reply()
        if reply is not None and self._outcome is None and (end := command_outcome(reply, now)):
            self._outcome, self._why = end
        return self._outcome is not None

    def _accepted_reply(self) -> CommandReply | None:
        if self._reply is None:
            self._reply = self._read_reply()
        return self._reply


class Head(ABC):
    """A head of this program, or one that runs in another program.

    World frame: at the neck base, x ahead, y left, z up. Head frame: the same axes, turned with
    the head, with the origin midway between the eyes. Units are metres and seconds. Arguments take
    angles in degrees; the names of values end with their unit. Yaw is positive to the left, pitch
    upwards.

    Orders return immediately. ``Order.reply`` returns the head's reply, and
    ``Order.wait`` waits for them to end. An order that takes control of gaze or joints keeps it
    until another order takes it, until ``look_freely``, until its time (``for_s``) is over, or
    until the head's ``with`` block or the program ends.

    Attributes:
        rig: name or path of the rig.
    """

    rig: str
    _who = "the program"
    _stay = True
    _poll_s = 0.004
    _clock = RealClock()

    @abstractmethod
    def __enter__(self) -> Self:
        """Start the head, or connect to it."""

    @abstractmethod
    def __exit__(self, *raised: Any) -> None:
        """Park and switch off a head of this program, or disconnect from another program's."""

    # Gaze

    def look_at(self, x_m: float, y_m: float, z_m: float, *, for_s: float | None = None) -> Order:
        """Look at a point of the world with head and eyes.

        Args:
            x_m: metres ahead.
            y_m: metres to the left.
            z_m: metres up.
            for_s: seconds until the order gives up control.

        Raises:
            Refused: the coordinates are not a point.
        """
        return self._send(LookAt((x_m, y_m, z_m), stay=self._stay, for_s=for_s))

    def look_towards(
        self, yaw_deg: float, pitch_deg: float, *, frame: Frame = "world",
        distance_m: float = FAR_M, for_s: float | None = None,
    ) -> Order:  # fmt: skip
        """Look in a direction, seen from the present position of the head.

        Args:
            yaw_deg: angle to the left, -180..180.
            pitch_deg: angle upwards, -90..90.
            frame: "world", or "head": relative to the direction that the head faces now.
            distance_m: distance at which the eyes converge.
            for_s: seconds until the order gives up control.

        Raises:
            Refused: the angles are not a direction.
        """
        angles = (radians(yaw_deg), radians(pitch_deg))
        return self._send(LookAtDirection(angles, frame, distance_m, stay=self._stay, for_s=for_s))

    def look_at_person(self, id: int, *, for_s: float | None = None) -> Order:
        """Look at a person's face, part by part as people do, and follow it.

        The order ends when the person has not been seen for two seconds.

        Args:
            id: ``Person.id``.
            for_s: seconds until the order gives up control.
        """
        return self._send(LookAtPerson(id, stay=self._stay, for_s=for_s))

    def find(self, sought: Sought = "anybody") -> Order:
        """Search for a person for at most 7.5 s; look at the one who is found, and follow.

        ``Order.wait`` returns "arrived" or "not found", ``Order.why`` who is where; the numbers are
        in ``state.client_control.found``.

        Args:
            sought: ``Person.id``, or "left" or "right" for anybody on that side of the head.
        """
        return self._send(Find(sought, stay=self._stay))

    def look_at_pixel(
        self, x_px: float, y_px: float, *, distance_m: float | None = None,
        captured_s: float | None = None, for_s: float | None = None,
    ) -> Order:  # fmt: skip
        """Look at the object at a pixel of the camera image, from the camera's pose at that time.

        Args:
            x_px: distance to the right from the centre of the upper left pixel.
            y_px: distance downwards from there.
            distance_m: distance from the camera; None: as measured by the camera, or that of the
                object detected there.
            captured_s: time of the frame (``HeadState.frame_s``); None: the newest frame.
            for_s: seconds until the order gives up control.
        """
        pixel = (x_px, y_px)
        return self._send(LookAtPixel(pixel, distance_m, captured_s, stay=self._stay, for_s=for_s))

    def look_freely(self) -> Order:
        """Let the head choose its targets again."""
        return self._send(LookAt(None))

    # Joints

    def jog(self, joint: str, deg: float, *, for_s: float | None = None) -> Order:
        """Hold all joints and move one slowly to an angle.

        Args:
            joint: its name, as in ``joints``.
            deg: its angle.
            for_s: seconds until the order gives up control.

        Raises:
            Refused: the rig has no such joint, or the angle is outside its range.
        """
        return self._send(Jog(((joint, radians(deg)),), stay=self._stay, for_s=for_s))

    def release_joints(self) -> Order:
        """Return all joints from ``jog`` to the control of gaze."""
        return self._send(Jog(()))

    # Face and behaviour

    def play(
        self, track: str, *, speed: float = 1.0, times: int = 0, from_s: float | str = 0.0,
        loop: bool = False,
    ) -> Order:  # fmt: skip
        """Play a track, once; the eyes keep their target unless it moves them.

        Its state is in ``tracks``, its number in ``Order.reply.track.number``.

        Args:
            track: its name; "" ends all tracks.
            speed: factor on the speed at which it was written.
            times: number of repetitions; 0: as the track defines.
            from_s: position, in s or as the name of a cue, at which it begins.
            loop: whether it repeats until it is ended.

        Raises:
            Refused: the rig has no such track; the message lists its tracks.
        """
        return self._send(Play(track, speed, times, from_s, loop))

    def end_track(self, track: str = "") -> Order:
        """End a track, or all; its joints return to gaze."""
        return self._send(EndTrack(track))

    def express(self, expression: str, strength: float = 1.0) -> Order:
        """Blend to an expression of the rig's table, and keep it.

        Args:
            expression: its name; "neutral" ends it.
            strength: 0 (no effect) .. 1 (as defined).
        """
        return self._send(Express(expression, strength))

    def level(self, name: str, value: float) -> Order:
        """Set a level of the rig's table, such as the jaw's opening by loudness.

        It falls to 0 unless it is set again within half a second.

        Args:
            name: name of the level.
            value: 0..1.
        """
        return self._send(SetLevel(name, value))

    def move_opponent(self, ahead_m: float, left_m: float, up_m: float) -> Order:
        """Move the leading fist of a boxing world's opponent towards a point for 1 s.

        Args:
            ahead_m: x of the point, which the opponent's arm can reach.
            left_m: y of it.
            up_m: z of it.
        """
        return self._send(MoveOpponent((ahead_m, left_m, up_m)))

    def say(
        self, what: str | Path | Iterable[bytes], *, rate_hz: int = 16000, channels: int = 1,
        volume: float = 1.0,
    ) -> Order:  # fmt: skip
        """Say a sound file, a text, or a stream, with the mouth of a rig that has one.

        A text needs espeak-ng. A stream is heard 0.15 s after its pieces arrive; this
        method returns when its last piece has been accepted.

        Args:
            what: a file (.wav, .flac, .mp3, .ogg), a text, or pieces of a stream: samples, signed,
                16 bits, channels interleaved, of 20 to 60 ms each.
            rate_hz: rate of a stream.
            channels: number of channels of a stream, 1 or 2.
            volume: factor 0..1; with 0, only the mouth moves, to a stream that is heard elsewhere.

        Raises:
            Refused: it cannot be said; the message names the file or program and the remedy.
        """
        if not isinstance(what, str | Path):
            return self._say_stream(what, rate_hz, channels, volume)
        text = str(what)
        if Path(text).suffix.lower() in KINDS and Path(text).is_file():
            text = str(Path(text).absolute())
        return self._send(Say(text, volume))

    def _say_stream(
        self, pieces: Iterable[bytes], rate_hz: int, channels: int, volume: float
    ) -> Order:
        """Say a stream; return when its last piece has been accepted."""
        for piece in pieces:
            ahead_s = self._say_piece(piece, rate_hz, channels, volume)
            if ahead_s > STREAM_AHEAD_S:
                self.sleep(ahead_s - STREAM_AHEAD_S)
        self._say_piece(b"", rate_hz, channels, volume, last=True)
        return Order(self, CommandReply)

    def _say_piece(
        self, piece: bytes, rate_hz: int, channels: int, volume: float, last: bool = False
    ) -> float:
        """Say a piece of a stream; return the length that has not been heard, s."""
        return float(self._ask(SayPiece(piece, rate_hz, channels, last, volume), float))

    # Conversation

    def listening(self, person: int | None = None) -> Order:
        """Look as a listener does, from now on; report it when the partner begins to speak.

        The state of conversation lasts until the next one. It ends with the program.

        Args:
            person: ``Person.id`` of the partner; None: the same as before, or unknown.

        Raises:
            Refused: a value is invalid.
        """
        return self._send(Talk("listening", person, stay=self._stay))

    def thinking(self, person: int | None = None) -> Order:
        """Look away as a person who thinks; report it when the partner has finished.

        Args:
            person: as in ``listening``.
        """
        return self._send(Talk("thinking", person, stay=self._stay))

    def speaking(
        self, person: int | None = None, *, seconds: float | None = None, text: str = ""
    ) -> Order:
        """Look as a speaker does, from now on; report it when the sound begins.

        A long turn begins averted, and the gaze returns to the partner before the planned end.
        Report it again to correct the plan.

        Args:
            person: as in ``listening``: the addressee.
            seconds: time until the planned end; None: estimated from ``text``.
            text: what is spoken.

        Raises:
            Refused: a value is invalid.
        """
        return self._send(Talk("speaking", person, seconds, text, self._stay))

    def interrupt(self) -> Order:
        """Return to the face at once and listen: the partner has interrupted speech or thought."""
        return self._send(Talk("interrupt", stay=self._stay))

    def idle(self) -> Order:
        """End the conversation; the head looks as without one."""
        return self._send(Talk("idle", stay=self._stay))

    def behave(self, behaviour: str) -> Order:
        """Choose a behaviour of the rig's rules.

        Raises:
            Refused: the rig has no such behaviour; the message lists its behaviours.
        """
        return self._send(Ask("behaviour", behaviour))

    def wink(self, side: Literal["left", "right"]) -> Order:
        """Wink once with the head's own left or right eye."""
        return self._send(Ask("lids", f"wink {side}"))

    # Stop

    def stop(self, why: str = "requested by the program") -> Order:
        """Switch the torque off immediately, without parking; the program continues."""
        order = self._send(Stop(why))
        _ = order.reply  # wait until the torque is off
        return order

    def resume(self, *, confirmed: bool = False) -> Order:
        """Switch the torque on again after a stop, at the present angles, and start slowly.

        Args:
            confirmed: a person has confirmed that no hand is in the mechanism; needed if another
                person or program has stopped the head.
        """
        order = self._send(Resume(confirmed))
        _ = order.reply
        return order

    # Parameters

    def get(self, prefix: str = "") -> Mapping[str, Value]:
        """Return the present values of all keys of the rig that start with a prefix."""
        return {key: as_value(value) for key, value in self._ask(Get(prefix), dict).items()}

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Apply values at dotted keys, all of them or none.

        Returns:
            One line for each value that has changed.

        Raises:
            Refused: rules are broken; the message names all of them.
        """
        return tuple(self._ask(Set(dict(changes)), tuple))

    def save(self, path: Path | str | None = None) -> Path:
        """Write the present values into the rig's file, or into another one; return its path.

        Raises:
            Refused: the file cannot be written, or is a file of the program.
        """
        whole = None if path is None else str(Path(path).expanduser().absolute())
        saved: SavedFile = self._ask(Save(whole), SavedFile)
        return saved.path

    def revert(self) -> tuple[str, ...]:
        """Restore the values of the rig's file; return a line for each change."""
        return tuple(self._ask(Revert(), tuple))

    def menus(self) -> Mapping[str, tuple[str, ...]]:
        """Return behaviours, conversation modes and lid states; the active one is the first."""
        return dict(self._ask(ReadMenus(), dict[str, tuple[str, ...]]))

    @abstractmethod
    def _ask(self, request: Request, kind: Any) -> Any:
        """Send a request; return its result, which has the given type.

        Raises:
            Refused: a rule forbids it.
        """

    # State

    @property
    @abstractmethod
    def state(self) -> HeadState:
        """Return the newest tick of the control loop."""

    @property
    def joints(self) -> Mapping[str, JointReading]:
        """Return the joints by name."""
        return self.state.joints

    @property
    def gaze(self) -> GazeReading:
        """Return the pose of head and eyes and their target."""
        return self.state.gaze

    @property
    def people(self) -> tuple[Person, ...]:
        """Return the people who are visible."""
        return self.state.people

    def picture(self) -> bytes:
        """Return the newest picture of the camera, a JPEG.

        Raises:
            Refused: there is none.
        """
        return bytes(self._ask(ReadPicture(), bytes))

    def states(self, rate_hz: float = 50.0, *, seconds: float | None = None) -> Iterator[HeadState]:
        """Return an iterator over the newest states; states that are not read in time are dropped.

        The control loop never waits for the reader. For a head in simulated time each step of the
        iterator steps the head.

        Args:
            rate_hz: highest number of states per second.
            seconds: duration by the head's own clock; None: without end.
        """
        if not rate_hz > 0.0:
            raise Refused(f"rate_hz {rate_hz:g}: above 0")
        last_s, end_s = float("-inf"), float("inf")
        while True:
            state = self.state
            if seconds is not None and end_s == float("inf"):
                end_s = state.t_s + seconds
            if state.t_s >= end_s:
                return
            if state.t_s > last_s:
                last_s = state.t_s
                yield state
            self._pause(lambda: False, 1.0 / rate_hz)

    def events(
        self, timeout_s: float | None = None, *, kinds: Container[EventKind] = ("message",)
    ) -> Iterator[HeadEvent]:
        """Return an iterator over all events since the start; it waits for the next one.

        The head stores the last 1000 messages and the last 1000 events of other kinds.

        Args:
            kinds: kinds of events, as in ``HeadEvent.kind``.
            timeout_s: ends after this time without an event; 0: after the stored events; None:
                never.
        """
        number = 0

        def has_events() -> bool:
            return any(event.kind in kinds for event in self._events(number))

        while True:
            for event in self._events(number):
                number = event.number
                if event.kind in kinds:
                    yield event
            if timeout_s == 0.0:
                return
            self._pause(has_events, timeout_s or 3600.0)
            if timeout_s is not None and not has_events():
                return

    def sleep(self, seconds: float) -> None:
        """Wait by the head's own clock; a head in simulated time is stepped.

        Raises:
            HeadEnded: the head has ended in the meantime.
        """
        self._pause(lambda: False, seconds)

    @abstractmethod
    def _progress(self) -> Progress:
        """Return the owner of gaze and joints, and the tracks."""

    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        """Wait by the head's clock until a condition is true, at most ``seconds``.

        Raises:
            HeadEnded: the head has ended in the meantime.
        """
        end_s = self._clock.now_s() + seconds
        while not until() and (now_s := self._clock.now_s()) < end_s:
            self._clock.sleep_until(min(now_s + self._poll_s, end_s))

    @abstractmethod
    def _events(self, after: int) -> tuple[HeadEvent, ...]:
        """Return the stored events with numbers above ``after``."""

    @abstractmethod
    def _send(self, command: Command) -> Order:
        """Send a command to the head under this program's name.

        Raises:
            Refused: a value of the command is invalid.
        """
