"""Door to Pipecat: RTVI messages over a WebSocket.

A client program forwards the RTVI messages that it receives to the door, and with addressed those
of the door to the bot. Messages: docs.pipecat.ai/client/rtvi-standard.
"""

from collections.abc import Mapping
from typing import Any
from uuid import uuid4

from gazerig.doors.door import Door, DoorLink
from gazerig.doors.turn_taking import Orders, TurnTaking, UnknownMessage, field
from gazerig.doors.web_socket import receive_sockets


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
        return ()

    def addressed(self, person: int | None) -> Mapping[str, Any]:
        """Return a client's message, for the client to pass on to the bot."""
        data = {"t": "addressed", "d": {"person": person}}
        return {"label": "rtvi-ai", "type": "client-message", "id": str(uuid4()), "data": data}


async def serve(link: DoorLink) -> None:
    """Receive RTVI messages."""
    await receive_sockets(link, Pipecat, "RTVI messages of a Pipecat client")


DOOR = Door("pipecat", serve, "Pipecat: RTVI messages of a client", bind="127.0.0.1:6056")
