"""Door to Linux Voice Assistant, Home Assistant's satellite: its peripheral API on a WebSocket.

The events are those of docs/peripheral_api.md in github.com/OHF-Voice/linux-voice-assistant:
``{"event": NAME, "data": {...}}``. They have no times of words, so the end of speech is estimated
from the text.
"""

from collections.abc import Mapping
from typing import Any

from gazerig.doors.door import Door, DoorLink
from gazerig.doors.turn_taking import Orders, TurnTaking, UnknownMessage, field
from gazerig.doors.web_socket import follow_socket


class VoiceAssistant:
    """Events of one connection as orders."""

    def __init__(self) -> None:
        self.talk = TurnTaking()

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for an event; events of timers, volume and lights are ignored.

        Raises:
            UnknownMessage: it is not an event.
        """
        talk, data = self.talk, field(message, "data", dict, {})
        match message.get("event"):
            case "wake_word_detected" | "listening":
                return talk.partner_speaks()
            case "stt_text" | "thinking":
                return talk.partner_pauses()
            case "tts_text":
                return talk.add_text(field(data, "text", str, ""), now_s)
            case "tts_speaking":
                return talk.speak(now_s)
            case "tts_finished":
                return talk.end_speech()
            case "snapshot" | "idle" | "pipeline_error" | "disconnected":
                return talk.end()
            case "muted":
                return talk.end() if data.get("muted") is True else ()
            case None:
                raise UnknownMessage(
                    "a message without an event is ignored; check that the address is that of a "
                    "Linux Voice Assistant"
                )
        return ()

    def addressed(self, person: int | None) -> Mapping[str, str] | None:
        """Return the command to listen, as at a press of its button."""
        return {"command": "start_listening"} if person is not None else None


async def serve(link: DoorLink) -> None:
    """Follow a voice assistant; reconnect for ever."""
    await follow_socket(
        link,
        VoiceAssistant,
        "a Linux Voice Assistant",
        "start it without --disable-peripheral-api",
    )


DOOR = Door(
    "voice-assistant",
    serve,
    "Linux Voice Assistant of Home Assistant",
    address="ws://127.0.0.1:6055",
)
