"""Requests of another program to a running rig, and the answers, as plain JSON values.

{"do": "set", "changes": {"loop.rate_hz": 100.0}}  ->  {"ok": {"notes": []}}
{"do": "set", "changes": {"loop.rate_hz": 1e9}}    ->  {"refused": "... is above 1000 ..."}
"""

import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from math import degrees
from pathlib import Path

from gazerig.robot.control.command_handler import (
    FIXED,
    CommandHandler,
    CommandTarget,
    ParamAccess,
    ParamsChanged,
    ParamsSaved,
    PathGuard,
    PendingCommand,
    QuestionAnswer,
    RequestResult,
    Speaker,
    as_changes,
)
from gazerig.robot.control.feedback_basis import estimated_joints
from gazerig.robot.control.head_state import as_json as state_as_json
from gazerig.robot.control.head_state import head_state
from gazerig.robot.control.loop_timing import busy_text
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_feed import TickFeed
from gazerig.robot.control.tick_text import (
    camera_conditions,
    control_text,
    head_activity,
    tick_control_source,
)
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.command_json import set_client
from gazerig.robot.model.commands import Command
from gazerig.robot.model.control_source import control_sentence
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.types import LoopFigures
from gazerig.robot.remote.socket_io import VERSION

_TAKEN_UP_S = 1.0
"""Timeout of the loop's execution, s; a servo that answers late delays it by some 50 ms."""
_WORDS = 20
"""Number of recent messages in the status."""

_HANGS = (
    f"the control loop has not executed it within {_TAKEN_UP_S:g} s: it hangs, "
    "starts or ends; use the emergency stop if anything moves"
)


class LoopMonitor:
    """Newest tick, and whether the loop is running.

    Args:
        clock: Clock of the loop.
        timing: Returns the timing statistics of the loop, None if unknown.
    """

    def __init__(
        self, clock: Clock, timing: Callable[[], LoopFigures | None] = lambda: None
    ) -> None:
        self._clock, self._timing = clock, timing
        self._feed = TickFeed()
        self._never = threading.Event()

    @property
    def update(self) -> Callable[[Tick], None]:
        """Return the function that stores the newest tick, for the loop."""
        return self._feed.update

    def wait_for_commands(self) -> bool:
        """Wait until all previous changes are applied; return whether they are."""
        # The present tick may have read the commands already, the next one has not.
        wanted = self._feed.ticks + 2
        waits = int(_TAKEN_UP_S / 0.002)
        while self._feed.ticks < wanted and waits > 0:
            self._never.wait(0.002)
            waits -= 1
        return self._feed.ticks >= wanted

    def state(self, after: int) -> dict[str, object]:
        """Return the newest tick, None before the first, and events numbered above ``after``."""
        tick = self._feed.newest
        events = [asdict(one) for one in self._feed.events(after)]
        state = state_as_json(head_state(tick)) if tick else None
        return {"state": state, "events": events, "number": self._feed.number}

    def as_json(self) -> dict[str, object]:
        """Return the newest tick as plain values: degrees, seconds, text."""
        tick = self._feed.newest
        if tick is None:
            return {"ticks": 0, "stopped": "", "said": []}
        does, leads = head_activity(tick), tick_control_source(tick)
        measured = zip(tick.guard_result.joints, tick.joints.position_rad, strict=True)
        return {
            "ticks": self._feed.ticks,
            "t_s": tick.t_s,
            "age_s": self._clock.now_s() - tick.t_s,
            "stopped": tick.stopped,
            "controlled_by": tick.controlled_by,
            "control_text": control_text(tick),
            "conversation": tick.conversation._asdict(),
            "control_kind": leads.kind,
            "control_sentence": control_sentence(leads, tick.t_s),
            "headline": does.headline,
            "busy": busy_text(self._timing()),
            "limited": [
                {
                    "axis": one.axis,
                    "asked_deg": round(degrees(one.asked_rad), 2),
                    "done_deg": round(degrees(one.done_rad), 2),
                    "reason": one.reason,
                }
                for one in tick.gaze.limited
            ],
            "camera": list(camera_conditions(tick)),
            "level": tick.guard_result.level,
            "reasons": list(tick.guard_result.reasons),
            "limp": list(tick.guard_result.limp),
            "target": does.target,
            "why": does.reason,
            "phase": does.phase,
            "joints_deg": {name: round(degrees(angle), 2) for name, angle in measured},
            "estimated": list(estimated_joints(tick)),
            "reckoned": list(estimated_joints(tick)),  # the former key, for compatibility
            "said": [event.text for event in self._feed.messages()[-_WORDS:]],
        }


class _CommandRefused(ValueError):
    """The robot has received a command and refused it."""

    def __init__(self, reply: CommandReply) -> None:
        super().__init__(reply.refused)
        self.reply = reply


class RequestHandler:
    """Executes requests of other programs; answers {"ok": ...} or {"refused": ...}.

    Args:
        robot: Executes commands.
        params: Parameters; None if they cannot be read or changed.
        pulse: State of the loop.
        about: Constant fields of the status, e.g. {"rig": name, "pid": process}.
        refusals: Exceptions besides ValueError that ``params`` raises if a value breaks a rule.
        saved: Called with each file that was written.
        fixed: Reason why parameters cannot be changed, if they cannot.
        fault: Executes a fault command of emulated servos; None if the servos are real.
        changing: Returns the other fields of the status, e.g. {"page": address}.
        paths: Rules for the files that a client of the network may name; None if any.
        voice: Says sounds and texts; None if the head has no voice.
    """

    def __init__(
        self,
        robot: CommandTarget,
        params: ParamAccess | None,
        pulse: LoopMonitor,
        about: Mapping[str, object],
        refusals: tuple[type[Exception], ...] = (),
        saved: Callable[[Path], None] | None = None,
        fixed: str = FIXED,
        fault: Callable[[str], str] | None = None,
        changing: Callable[[], Mapping[str, object]] = dict,
        paths: PathGuard | None = None,
        voice: Speaker | None = None,
    ) -> None:
        self._params = params
        self._pulse = pulse
        self._changing = changing
        self._about = dict(about)
        self._handler, self._network = (
            CommandHandler(
                robot,
                params,
                self._status,
                refusals,
                saved,
                rules,
                fixed=fixed,
                state=pulse.state,
                fault=fault,
                voice=voice,
            )
            for rules in (None, paths)
        )
        self._unsaved = -1, 0

    def answer(self, request: object, peer: str = "") -> dict[str, object]:
        """Execute one request; return {"ok": result} or {"refused": every broken rule}.

        Args:
            request: Request {"do": verb, ...}. Its "tag" is returned with the answer; the page's
                process marks requests of the network by "network": true.
            peer: Client at the other end, e.g. "process 123", "" if unknown.
        """
        tag: dict[str, object] = {}
        handler = self._handler
        if isinstance(request, dict):
            tag = {key: request[key] for key in ("tag",) if key in request}
            handler = self._network if request.get("network") is True else handler
            request = {key: request[key] for key in request if key not in ("tag", "network")}
        try:
            match request:
                case {"do": "hello", "version": int(version), **rest} if not rest:
                    return {"ok": self._greeting(version), **tag}
            done = handler.handle(request, partial(_set_client, peer))
            return {"ok": self._outcome_json(done), **tag}
        except _CommandRefused as error:
            return {"refused": str(error), "reply": error.reply.as_json(), **tag}
        except handler.refusals as error:
            return {"refused": str(error), **tag}

    def _greeting(self, version: int) -> dict[str, object]:
        """Return the greeting of the rig.

        Raises:
            ValueError: The client has another version of the messages.
        """
        if version != VERSION:
            raise ValueError(
                f"version {version} of the messages: this rig has {VERSION}; "
                "update gazerig or the program"
            )
        return {"version": VERSION, **self._about}

    def _outcome_json(self, outcome: RequestResult) -> object:
        """Return an outcome as JSON after the loop has executed it."""
        match outcome:
            case QuestionAnswer(value):
                return value
            case ParamsChanged(notes):
                return self._wait_until_applied(notes)
            case ParamsSaved(saved):
                backup = None if saved.backup is None else str(saved.backup)
                changes = as_changes(saved.changes)
                return {"path": str(saved.path), "backup": backup, "changes": changes}
            case PendingCommand(_, ticket):
                if ticket is None:
                    return self._wait_until_applied(())
                reply = ticket.wait(_TAKEN_UP_S)
                if reply is None:
                    raise ValueError(_HANGS)
                if reply.refused:
                    raise _CommandRefused(reply)
                return {"notes": [], "reply": reply.as_json()}

    def _status(self) -> dict[str, object]:
        version = self._params.version if self._params is not None else 0
        if version != self._unsaved[0]:  # count once for a program that polls
            unsaved = self._params.unsaved() if self._params is not None else ()
            self._unsaved = version, len(tuple(unsaved))
        about = {**self._about, **self._changing(), "version": version, "unsaved": self._unsaved[1]}
        return {**about, **self._pulse.as_json()}

    def _wait_until_applied(self, notes: tuple[str, ...]) -> dict[str, object]:
        """Wait for the tick that applies the values; return the notes for the user."""
        if not self._pulse.wait_for_commands():
            raise ValueError(_HANGS)
        return {"notes": list(notes)}


def _set_client(peer: str, command: Command) -> Command:
    """Return a command with the client's process: it cannot pose as another one or the page."""
    who = str(getattr(command, "who", ""))
    return set_client(command, f"{who} ({peer})" if who else peer) if peer else command


def is_stop(request: object) -> bool:
    """Return whether a request is a stop, which nothing may delay."""
    match request:
        case {"do": "stop"}:
            return True
    return False
