"""Requests of the page's users to the rig: commands, tuning, clicks in the image."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from gazerig.gaze.types import Vec3
from gazerig.robot.control.command_handler import CommandHandler, ParamAccess, PathGuard
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import (
    ClientCommand,
    ControlCommand,
    LookAt,
    Request,
    Resume,
    Stop,
    set_client,
)
from gazerig.robot.model.reply import CommandTaker, Ticket
from gazerig.robot.model.requests import Character, Revert, Save, Set, read_request

_REPLY_S = 1.0
_STOP_S = 0.8
"""Timeout of a stop, s; the page waits for a second, then sends it again."""
_SAID_EVERY_S = 3.0
_LATER = "next start"
"""Time of effect of the changes that are reported in a message; the controls show the others."""


PAGE = "the page"
"""Name of the sender if a browser sends none."""

Point = Callable[[float, float], Vec3 | None]
"""Position in the image, 0..1 from the left and from the top -> point in the world."""


class PageRequestHandler:
    """Executes requests of the page; a call returns the message for the user.

    Args:
        command: executes commands.
        params: parameters that can be changed; None: there are none.
        point: returns the point in the world at a position in the image; None: there is no image.
        refusals: exceptions besides ValueError that ``params`` raises for values that break a rule.
        saved: called with each written file.
        paths: permitted files; None: any.
    """

    def __init__(
        self,
        command: CommandTaker,
        params: ParamAccess | None = None,
        point: Point | None = None,
        refusals: tuple[type[Exception], ...] = (),
        saved: Callable[[Path], None] | None = None,
        paths: PathGuard | None = None,
    ) -> None:
        self._handler = CommandHandler(command, params, refusals, saved)
        self._paths = paths
        self._point = point
        self._clock = RealClock()
        self._limited_s = -_SAID_EVERY_S

    def __call__(self, data: Mapping[str, object]) -> str | None:
        """Execute a request; return a message or refusal, None if there is none."""
        try:
            return self._do(data)
        except self._handler.refusals as error:
            return f"refused: {error}"

    def _do(self, data: Mapping[str, object]) -> str | None:
        match data:
            case {"do": _}:
                return self._execute(read_request(data))
            case {"pick": {"x": int() | float() as x, "y": int() | float() as y, **rest}}:
                if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
                    raise ValueError(
                        "a place in the image is 0 to 1 from the left and from the top"
                    )
                point = self._point(float(x), float(y)) if self._point is not None else None
                if point is None:
                    return "refused: there is no camera image to look into yet"
                who = str(rest.get("who") or PAGE)
                return self._execute(LookAt(point, who=who))
        raise ValueError(f"{', '.join(map(str, data)) or 'nothing'} is not available here")

    def _execute(self, request: Request) -> str | None:
        """Execute a request; return the message for the user, None if there is none."""
        if isinstance(request, ClientCommand) and not request.who:
            request = set_client(request, PAGE)
        done: Any = self._handler.handle(request, self._paths)
        match request:
            case ControlCommand() | Resume() | Stop() if done is not None:
                return self._reply_text(done, _STOP_S if isinstance(request, Stop) else _REPLY_S)
            case Save():
                kept = f", what was there is in {done.backup}" if done.backup is not None else ""
                return f"saved in {done.path}{kept}"
            case Set():
                return "\n".join(note for note in done if _LATER in note) or None
            case Revert():
                return "\n".join(done) or "all is as in the file again"
            case Character(name):
                return "\n".join(done) or f"the character is {name}"
        return None  # the page receives the other answers in other messages

    def _reply_text(self, ticket: Ticket, within_s: float) -> str | None:
        """Return a command's restrictions as text, None if there are none."""
        reply = ticket.wait(within_s)
        if reply is None:
            return "the control loop has not taken it up: it hangs, starts or ends"
        if reply.refused:
            return f"refused: {reply.refused}"
        if not reply.limited:
            return None
        # If a user drags a target out of reach, send only one message per interval.
        now_s = self._clock.now_s()
        if now_s - self._limited_s < _SAID_EVERY_S:
            return None
        self._limited_s = now_s
        return reply.text()
