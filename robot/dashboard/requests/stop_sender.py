"""Page's end of the stop channel; see gazerig.robot.dashboard.requests.stop_channel.

The other end is in the process of the control loop, which imports no event loop.
"""

import asyncio
import contextlib
import json

from gazerig.drivers.process.message_link import MessageLink
from gazerig.robot.dashboard.requests.stop_channel import MESSAGE_BYTES, WORDS

_ANSWERED_WITHIN_S = 1.0


class StopSender:
    """Page's end of the channel, in the event loop that serves the browsers."""

    def __init__(self, link: MessageLink) -> None:
        link.setblocking(False)
        self._link = link
        self._number = 0
        self._waiting: asyncio.Future[str] | None = None

    async def send(self, why: str, who: str) -> str:
        """Send a stop; return the rig's answer, "" if it is executed at the next tick.

        Raises:
            OSError: the rig has ended or does not answer.
        """
        if self._waiting is None:
            self._number += 1
            stop = {"number": self._number, "do": "stop", "why": why[:WORDS], "who": who[:WORDS]}
            # The buffer may be full of stops; a rig that hangs receives them when it resumes.
            with contextlib.suppress(BlockingIOError):
                self._link.send(json.dumps(stop).encode())
            self._waiting = asyncio.get_running_loop().create_future()
        waiting = self._waiting
        try:
            return await asyncio.wait_for(asyncio.shield(waiting), _ANSWERED_WITHIN_S)
        except TimeoutError:
            if self._waiting is waiting:  # the next call sends again
                self._waiting = None
            raise OSError("the rig does not answer") from None

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Receive the replies in this event loop."""
        loop.add_reader(self._link.fileno(), self._receive)

    def _receive(self) -> None:
        try:
            data = self._link.recv(MESSAGE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            asyncio.get_running_loop().remove_reader(self._link.fileno())
            return
        number, text = json.loads(data)
        if number == self._number and self._waiting is not None:
            self._waiting.set_result(text)
            self._waiting = None
