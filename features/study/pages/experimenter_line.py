"""The experimenter's connection: the session's live state, the head's health, and the buttons.

It uses the live page's protocol, so that the stop button (browser/stop.js) is the same.
"""

import asyncio
import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Literal, Protocol

import aiohttp
from aiohttp import web

from gazerig.features.study.answers import WrongAnswer
from gazerig.features.study.design import StudyDesign
from gazerig.features.study.journal import WriteFailed
from gazerig.features.study.pages.study_files import HEADERS
from gazerig.features.study.screens import (
    ConsentScreen,
    EndScreen,
    InstructionsScreen,
    PausedScreen,
    PresentationScreen,
    QuestionsScreen,
    ReadyScreen,
    RestScreen,
    Screen,
)
from gazerig.features.study.study_run import StudyRun
from gazerig.robot.dashboard.door.sockets import TAKES_S, close_socket, until_one_ends
from gazerig.robot.dashboard.requests.outbox import ASKED_BYTES, add_client

HeadHealth = Literal["none", "alive", "late", "fault", "stopped"]
"""none: films are shown; late: it does not answer; stopped: its torque is off."""


@dataclass(frozen=True)
class HeadReport:
    """Health of the head; says: the fault or the reason of a stop, "" without one."""

    state: HeadHealth
    says: str = ""


class HeadLink(Protocol):
    """A head in another process; its methods are called from any thread, and block."""

    def report(self) -> HeadReport:
        """Return the head's health immediately."""
        ...

    def stop(self, why: str) -> str:
        """Switch its torque off; return the reason of a failure, "" on success.

        Raises:
            OSError: the head has ended, or does not answer.
        """
        ...

    def resume(self) -> str:
        """Switch its torque on again; return the reason of a failure, "" on success.

        Raises:
            OSError: the head has ended, or does not answer.
        """
        ...


class NoHead:
    """Replaces the head for films, with nothing to stop."""

    def report(self) -> HeadReport:
        """Report that there is no head."""
        return HeadReport("none")

    def stop(self, why: str) -> str:
        """Return the reason of the failure: no head is shown."""
        return "no head is shown"

    def resume(self) -> str:
        """Return the reason of the failure: no head is shown."""
        return "no head is shown"


WHO = "the experimenter"
_BEAT_S = 1.0
_READ_S = 5.0
_WORDS = 200
_DOING: dict[type[Screen], str] = {
    ConsentScreen: "reads the consent page",
    InstructionsScreen: "reads the instructions",
    ReadyScreen: "is asked to be ready",
    PresentationScreen: "looks at the presentation",
    QuestionsScreen: "answers questions",
    RestScreen: "rests",
    PausedScreen: "waits",
    EndScreen: "has read to the end",
}
Watch = Callable[[web.Request, str, Callable[[], Awaitable[None]], float], Awaitable[None]]


class ExperimenterLine:
    """The experimenter's connections.

    trouble: the last error of the disk, "" without one
    """

    def __init__(
        self,
        run: StudyRun,
        design: StudyDesign,
        head: HeadLink,
        watch: Watch,
        notify: Callable[[], None],
        finish: Callable[[], None],
    ) -> None:
        """Create it without connections."""
        self._run, self._design, self._head = run, design, head
        self._watch, self._notify, self._finish = watch, notify, finish
        self._opened_s = 0.0
        self.trouble = ""

    def add_to(self, router: web.UrlDispatcher) -> None:
        """Add the addresses that the page's scripts use."""
        self._opened_s = asyncio.get_running_loop().time()
        router.add_get("/rig/line", self._line)
        router.add_post("/rig/ask", self._handle_request)

    async def _line(self, request: web.Request) -> web.StreamResponse:
        """Send the state at every change and every second; receive stops."""
        line = web.WebSocketResponse(max_msg_size=ASKED_BYTES, compress=False)
        await line.prepare(request)

        async def tell() -> None:
            now_s = asyncio.get_running_loop().time() - self._opened_s
            state = await asyncio.to_thread(self._state, now_s)
            async with asyncio.timeout(TAKES_S):
                await line.send_str(json.dumps({"state": state}))

        await until_one_ends(self._watch(request, WHO, tell, _BEAT_S), self._receive(line))
        await close_socket(line, request)
        return line

    def _state(self, elapsed_s: float) -> dict[str, object]:
        """Return the state for the stop button and the page's script."""
        head, now = self._head.report(), self._run.state()
        shown = now.shown
        condition = self._design.conditions[shown.condition] if shown else None
        return {
            "stopped": head.says if head.state == "stopped" else "",
            "silent": head.state == "late",
            "headless": head.state == "none",
            "you": WHO,
            "trouble": self.trouble,
            "head": head.state,
            "head_says": head.says,
            "session": {
                "participant": now.participant,
                "doing": _DOING[type(now.screen)],
                "outcome": now.screen.outcome if isinstance(now.screen, EndScreen) else "",
                "trial": None if now.trial is None else now.trial + 1,
                "of": now.trials,
                "condition": shown.condition if shown else "",
                "label": condition.label if condition else "",
                "attempt": shown.attempt if shown else 0,
                "showing": now.presenting,
                "showing_s": now.elapsed_s,
                "answers": now.answers,
                "elapsed_s": elapsed_s,
                "fault": now.fault,
                "paused": now.paused,
            },
        }

    async def _receive(self, line: web.WebSocketResponse) -> None:
        async for message in line:
            if message.type is not aiohttp.WSMsgType.TEXT:
                continue
            status, text = await self._run_request(add_client(message.data, WHO))
            async with asyncio.timeout(TAKES_S):
                await line.send_str(json.dumps({"answer": status, "words": text}))

    async def _handle_request(self, request: web.Request) -> web.Response:
        async with asyncio.timeout(_READ_S):
            body = await request.read()
        status, text = await self._run_request(add_client(body, WHO))
        return web.Response(status=status, text=f"{text}\n" if text else None, headers=HEADERS)

    async def _run_request(self, asked: dict[str, object] | None) -> tuple[int, str]:
        """Run a request; return an HTTP status, and the reason of a refusal."""
        if asked is None:
            return 400, "not a JSON object that can be asked for"
        what, why = asked.get("do"), f"{asked.get('why', '')!s}".strip()[:_WORDS]
        try:
            refused = await asyncio.to_thread(self._press_button, what, why)
        except (WrongAnswer, WriteFailed) as error:
            return 409, str(error)
        except OSError as error:
            return 503, str(error)
        self._notify()
        return (503, refused) if refused else (204, "")

    def _press_button(self, what: object, why: str) -> str:
        """Press a button; return the reason of a refusal, "" on success."""
        match what:
            case "stop":
                return self._head.stop(f"{why} ({WHO})")
            case "resume":
                return self._head.resume()
            case "pause" | "go on":
                self._run.pause(what == "pause")
            case "repeat":
                self._run.repeat()
            case "exclude":
                if not why:
                    return "say why the participant is excluded; the report names the reason"
                self._run.exclude(why)
            case "end":
                self._finish()
            case _:
                return "there is no such button"
        return ""
