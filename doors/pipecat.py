"""Door to Pipecat: an observer for its pipelines, and RTVI messages over a WebSocket.

In the pipeline's program, one line is enough:

    task = PipelineTask(pipeline, observers=[HeadObserver()])

A client program elsewhere forwards the RTVI messages that it receives to the door's WebSocket.
Messages: docs.pipecat.ai/client/rtvi-standard; frames: pipecat/frames/frames.py.
"""

import logging
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gazerig.doors.door import Door, DoorLink, connect
from gazerig.doors.spoken_sound import MouthSound
from gazerig.doors.turn_taking import Orders, TurnTaking, UnknownMessage, field
from gazerig.doors.web_socket import receive_sockets

if TYPE_CHECKING:
    BaseObserver: Any = object
else:
    try:
        from pipecat.observers.base_observer import BaseObserver
    except ImportError:  # the WebSocket does not need Pipecat
        BaseObserver = object

FRAMES: Mapping[str, str] = {
    "UserStartedSpeakingFrame": "user-started-speaking",
    "UserStoppedSpeakingFrame": "user-stopped-speaking",
    "BotStartedSpeakingFrame": "bot-started-speaking",
    "BotStoppedSpeakingFrame": "bot-stopped-speaking",
    "InterruptionFrame": "bot-interrupted",
    "StartInterruptionFrame": "bot-interrupted",
    "LLMFullResponseStartFrame": "bot-llm-started",
    "LLMTextFrame": "bot-llm-text",
    "TTSTextFrame": "bot-tts-text",
    "EndFrame": "end",
    "CancelFrame": "end",
}
"""Name of a frame's class -> the RTVI message with the same meaning."""
_SOUND = "TTSAudioRawFrame"
_SILENCES = ("bot-interrupted", "bot-stopped-speaking", "end")


class Pipecat:
    """RTVI messages of one session as orders."""

    def __init__(self) -> None:
        self.talk = TurnTaking("listening", reports_silence=True, streams_text=True)
        self._has_text = False

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for an RTVI message; messages of no concern are ignored.

        Raises:
            UnknownMessage: it is not an RTVI message.
        """
        if message.get("label") != "rtvi-ai":
            raise UnknownMessage(
                "a message without the label 'rtvi-ai' is ignored; forward the RTVI messages as "
                "they are (protocol 1)"
            )
        talk, text = self.talk, field(field(message, "data", dict, {}), "text", str, "")
        match message.get("type"):
            case "user-started-speaking":
                return talk.partner_speaks()
            case "user-stopped-speaking":
                return talk.resume(now_s) or talk.partner_pauses()
            case "bot-interrupted":
                orders = talk.partner_speaks() if talk.state == "speaking" else ()
                return orders + talk.end_speech()
            case "bot-llm-started":
                self._has_text = False
                return talk.partner_pauses()
            case "bot-llm-text":
                self._has_text = True
                return talk.add_text(text, now_s)
            case "bot-tts-text":
                # Single words are reported while they are spoken, which reveals no end.
                ahead = not self._has_text and " " in text.strip()
                return talk.add_text(text, now_s) if ahead else ()
            case "bot-started-speaking":
                return talk.speak(now_s)
            case "bot-stopped-speaking":
                self._has_text = False
                return talk.end_speech()
            case "end":
                return talk.end()
        return ()


class HeadObserver(BaseObserver):  # type: ignore[misc]
    """An observer of a Pipecat pipeline that lets a running head take part.

    It never delays the pipeline and raises nothing; its messages go to the log "gazerig".

    Args:
        head: Process id or name of the head; None if only one runs on this computer.
        link: Connection to the head; None for a new one.
    """

    def __init__(self, head: int | str | None = None, link: DoorLink | None = None) -> None:
        super().__init__()
        self._head, self._link = head, link
        self._messages = Pipecat()
        self._seen: int | None = None
        self._mouth: MouthSound | None = None

    async def on_push_frame(self, data: Any) -> None:
        """Read a frame that one processor has pushed to the next."""
        frame = data.frame
        if type(frame).__name__ == _SOUND and getattr(data, "first_push", False):
            link = self._start()
            self._mouth = self._mouth or MouthSound(link)
            self._mouth.add(frame.audio, frame.sample_rate, frame.num_channels)
        kind = FRAMES.get(type(frame).__name__)
        number = getattr(frame, "id", None)
        # A frame is reported at each processor that it passes; a broadcast one, in both directions.
        upstream = getattr(getattr(data, "direction", None), "name", "") == "UPSTREAM"
        if kind is None or upstream or (number is not None and number == self._seen):
            return
        self._seen = number
        link = self._start()
        message = {"label": "rtvi-ai", "type": kind, "data": {"text": getattr(frame, "text", "")}}
        link.send(self._messages.take(message, link.now_s()))
        if self._mouth is not None and kind in _SILENCES:
            self._mouth.shut()

    async def cleanup(self) -> None:
        """Disconnect from the head."""
        if self._mouth is not None:
            self._mouth.shut()
        if self._link is not None:
            await self._link.close()
        if hasattr(super(), "cleanup"):
            await super().cleanup()

    def _start(self) -> DoorLink:
        """Return the connection; connect at the first frame."""
        if self._link is None:
            log = logging.getLogger("gazerig").warning
            self._link = DoorLink(lambda: connect(self._head, "Pipecat"), log)
        self._link.start()
        return self._link


async def serve(link: DoorLink) -> None:
    """Receive RTVI messages."""
    await receive_sockets(link, Pipecat, "RTVI messages of a Pipecat client")


DOOR = Door("pipecat", serve, "Pipecat: RTVI messages of a client", bind="127.0.0.1:6056")
