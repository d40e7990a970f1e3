"""What a program can ask of a head, wherever the head runs."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from math import radians
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from gazerig.order import Order
from gazerig.robot.control.head_state import (
    GazeReading,
    HeadEvent,
    HeadState,
    JointReading,
    Person,
)
from gazerig.robot.control.tick_feed import Progress
from gazerig.robot.model.commands import (
    FAR_M,
    Ask,
    Command,
    Express,
    Frame,
    Jog,
    LookAt,
    LookAtDirection,
    LookAtInHead,
    LookAtPerson,
    LookAtPixel,
    Play,
    Resume,
    SetLevel,
    Stop,
    Value,
)


class Head(ABC):
    """A head that a program speaks to: one of its own, or one that runs in another program.

    World frame: at the neck base, x ahead, y left, z up. Head frame: the same axes, turned with
    the head, from midway between the eyes. Metres and seconds; angles of arguments in degrees,
    those of values as their names say; yaw + left, pitch + up.

    Orders return at once; ``Order.reply`` says what is really done of them, ``Order.wait`` waits.
    What takes the lead of gaze or joints keeps it until something else takes it, ``look_freely``,
    its time (``for_s``), or the end of the head's ``with`` block or of the program.

    Attributes:
        rig: the rig by its name or path.
    """

    rig: str
    _who = "the program"
    _stay = True

    @abstractmethod
    def __enter__(self) -> Self:
        """Start, or connect."""

    @abstractmethod
    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Let go: park and switch off a head of one's own, hang up on another program's."""

    # Where to look

    def look_at(
        self, x_m: float, y_m: float, z_m: float, *, frame: Frame = "world",
        for_s: float | None = None,
    ) -> Order:  # fmt: skip
        """Look at a point with head and eyes.

        Args:
            x_m: metres ahead.
            y_m: metres to the left.
            z_m: metres up.
            frame: "world"; or "head": the point is where the head has it now, and stays there.
            for_s: the lead ends after so many seconds.

        Raises:
            Refused: it is no point.
        """
        if frame == "head":
            return self._give(LookAtInHead((x_m, y_m, z_m), self._who, self._stay, for_s))
        if frame != "world":
            from gazerig.errors import Refused

            raise Refused(f"frame {frame!r}: there is world, head")
        return self._give(LookAt((x_m, y_m, z_m), self._who, self._stay, for_s))

    def look_towards(
        self, yaw_deg: float, pitch_deg: float, *, frame: Frame = "world",
        distance_m: float = FAR_M, for_s: float | None = None,
    ) -> Order:  # fmt: skip
        """Look in a direction from where the head is now.

        Args:
            yaw_deg: to the left, -180..180.
            pitch_deg: upwards, -90..90.
            frame: "world", or "head": from straight ahead of the head as it is now.
            distance_m: on what the eyes converge.
            for_s: the lead ends after so many seconds.

        Raises:
            Refused: it is no direction.
        """
        angles = (radians(yaw_deg), radians(pitch_deg))
        return self._give(LookAtDirection(angles, frame, distance_m, self._who, self._stay, for_s))

    def look_at_person(self, id: int, *, for_s: float | None = None) -> Order:
        """Look at a person's face, part by part as people do, and follow.

        The lead ends when the person was not seen for two seconds.

        Args:
            id: ``Person.id``.
            for_s: the lead ends after so many seconds.
        """
        return self._give(LookAtPerson(id, self._who, self._stay, for_s))

    def look_at_pixel(
        self, x_px: float, y_px: float, *, distance_m: float | None = None,
        captured_s: float | None = None, for_s: float | None = None,
    ) -> Order:  # fmt: skip
        """Look at what a pixel of the camera's frame shows, by where the camera was then.

        Args:
            x_px: to the right from the centre of the upper left pixel.
            y_px: down from there.
            distance_m: of it from the camera; None: as measured by the camera, or as far as what
                is seen there.
            captured_s: time of the frame (``HeadState.frame_s``); None: the newest frame.
            for_s: the lead ends after so many seconds.
        """
        pixel = (x_px, y_px)
        return self._give(
            LookAtPixel(pixel, distance_m, captured_s, None, self._who, self._stay, for_s)
        )

    def look_freely(self) -> Order:
        """Let the head choose its targets again."""
        return self._give(LookAt(None, self._who))

    # Joints

    def jog(self, joint: str, deg: float, *, for_s: float | None = None) -> Order:
        """Hold all joints and move one slowly to an angle.

        Args:
            joint: its name, as in ``joints``.
            deg: its angle.
            for_s: the lead ends after so many seconds.

        Raises:
            Refused: there is no such joint, or the angle is outside its range.
        """
        return self._give(Jog(((joint, radians(deg)),), self._who, self._stay, for_s))

    def release_joints(self) -> Order:
        """Return all joints from ``jog`` to gaze."""
        return self._give(Jog((), self._who))

    # Face and behaviour

    def play(self, gesture: str, *, speed: float = 1.0, times: int = 0) -> Order:
        """Play a gesture over gaze, once; the eyes stay where they look.

        Args:
            gesture: its name; "" ends the one under way.
            speed: factor on the speed at which it was written.
            times: how often it is repeated; 0: as the gesture says.

        Raises:
            Refused: there is no such gesture; the message lists those there are.
        """
        return self._give(Play(gesture, speed, times, self._who))

    def express(self, expression: str, strength: float = 1.0) -> Order:
        """Blend to an expression of the rig's table, and keep it.

        Args:
            expression: its name; "neutral" ends it.
            strength: 0 none of it .. 1 as written.
        """
        return self._give(Express(expression, strength))

    def level(self, name: str, value: float) -> Order:
        """Set a level of the rig's table, such as a jaw by loudness.

        Without another call within half a second it falls to 0.

        Args:
            name: of the level.
            value: 0..1.
        """
        return self._give(SetLevel(name, value))

    def converse(self, mode: str) -> Order:
        """Look away and blink as speakers or listeners do.

        Args:
            mode: "none", "talk", "listen" or "think".

        Raises:
            Refused: there is no such mode.
        """
        return self._give(Ask("conversation", mode))

    def behave(self, behaviour: str) -> Order:
        """Choose a behaviour of the rig's rules.

        Raises:
            Refused: there is no such behaviour; the message lists those there are.
        """
        return self._give(Ask("behaviour", behaviour))

    def wink(self, side: Literal["left", "right"]) -> Order:
        """Wink once with the head's own left or right eye."""
        return self._give(Ask("lids", f"wink {side}"))

    # Stop

    def stop(self, why: str = "asked for by the program") -> Order:
        """Switch the torque off at once, without parking; the program goes on."""
        order = self._give(Stop(why, self._who))
        _ = order.reply  # obeyed when this returns
        return order

    def resume(self, *, confirmed: bool = False) -> Order:
        """Switch the torque on again after a stop, where the joints are, and go on slowly.

        Args:
            confirmed: a person has said that no hand is in the mechanism; needed where somebody
                else has stopped the head.
        """
        order = self._give(Resume(self._who, confirmed))
        _ = order.reply
        return order

    # Parameters

    @abstractmethod
    def get(self, prefix: str = "") -> Mapping[str, Value]:
        """Return the values in force of all keys of the rig that begin so."""

    @abstractmethod
    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Put values at dotted keys in force, all of them or none.

        Returns:
            One line for each value that is another one now.

        Raises:
            Refused: with every rule that is broken.
        """

    @abstractmethod
    def save(self, path: Path | str | None = None) -> Path:
        """Write what is in force into the rig's file, or another one; return the file.

        Raises:
            Refused: the file cannot be written, or comes with the program.
        """

    @abstractmethod
    def revert(self) -> tuple[str, ...]:
        """Put the values of the rig's file in force again; return a line for each."""

    @abstractmethod
    def menus(self) -> Mapping[str, tuple[str, ...]]:
        """Return behaviours, modes of conversation and what the lids do; those in force first."""

    # What is

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
        """Return where head and eyes are and what they look at."""
        return self.state.gaze

    @property
    def people(self) -> tuple[Person, ...]:
        """Return the people who are seen."""
        return self.state.people

    def states(self, rate_hz: float = 50.0, *, seconds: float | None = None) -> Iterator[HeadState]:
        """Return an iterator over the newest states; older ones that nobody took are dropped.

        The loop never waits for it. Of a head in simulated time each step of the iterator steps
        the head.

        Args:
            rate_hz: states a second at most.
            seconds: ends after so many, by the head's own clock; None: never.
        """
        if not rate_hz > 0.0:
            from gazerig.errors import Refused

            raise Refused(f"rate_hz {rate_hz:g}: above 0")
        return self._states(1.0 / rate_hz, seconds)

    def events(self, timeout_s: float | None = None) -> Iterator[HeadEvent]:
        """Return an iterator over what happens, from the start; it waits for the next event.

        At most the last 1000 events are kept for it.

        Args:
            timeout_s: ends after so long without an event; 0: with those there are; None: never.
        """
        number = 0
        while True:
            for event in self._events(number):
                number = event.number
                yield event
            if timeout_s == 0.0:
                return
            self._pause(partial(self._happened, number), timeout_s or 3600.0)
            if timeout_s is not None and not self._happened(number):
                return

    def sleep(self, seconds: float) -> None:
        """Wait so long by the head's own clock; in simulated time it is stepped.

        Raises:
            HeadEnded: the head has ended meanwhile.
        """
        self._pause(lambda: False, seconds)

    @abstractmethod
    def _progress(self) -> Progress:
        """Return the newest lead and gesture."""

    @abstractmethod
    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        """Let the head's time pass until something is true, for so long at most.

        Raises:
            HeadEnded: the head has ended meanwhile.
        """

    def _let_go(self) -> None:
        """Let the head choose its targets again, and do not ask what came of it."""
        self._give(LookAt(None, self._who))

    def _states(self, every_s: float, seconds: float | None) -> Iterator[HeadState]:
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
            self._pause(lambda: False, every_s)

    def _happened(self, after: int) -> bool:
        return bool(self._events(after))

    @abstractmethod
    def _events(self, after: int) -> tuple[HeadEvent, ...]:
        """Return the events kept whose numbers are above ``after``."""

    @abstractmethod
    def _give(self, command: Command) -> Order:
        """Hand on a command.

        Raises:
            Refused: it cannot be meant.
        """
