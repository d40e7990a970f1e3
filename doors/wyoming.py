"""Door to Wyoming, the protocol of Rhasspy and Home Assistant: ``snd`` and ``wake`` services.

The head plays the sound and moves its mouth by it. The same port accepts the events of a satellite
(``--event-uri``): detection, voice-started and -stopped, transcript, synthesize. With addressed, it
also detects a wake word that is no word (``--wake-uri``): a person addresses the head. Events:
github.com/OHF-Voice/wyoming; the package ``wyoming`` reads and writes them.
"""

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import gazerig
from gazerig.doors.door import Address, Door, DoorLink
from gazerig.doors.spoken_sound import WIDTH, SpokenSound
from gazerig.doors.turn_taking import Orders, TurnTaking, field

_WAKE, _LOOK = "look", "look at the head"
"""The wake word that is a look, and how it is said."""
_MAX_LINE = 65_536


class Wyoming:
    """Events of all connections of one satellite as orders."""

    def __init__(self) -> None:
        self.talk = TurnTaking()
        self.audio_s = 0.0

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for an event; other events are ignored.

        Args:
            message: "type", "data", and "audio_s", the duration of an audio-chunk.
            now_s: Present time, s.
        """
        talk, data = self.talk, field(message, "data", dict, {})
        match message.get("type"):
            case "detection" | "voice-started":
                return talk.partner_speaks()
            case "transcript" if not field(data, "text", str, "").strip():
                return talk.end()
            case "voice-stopped" | "transcript":
                return talk.partner_pauses()
            case "synthesize":
                return talk.add_text(field(data, "text", str, ""), now_s)
            case "audio-start":
                if talk.state != "speaking":  # otherwise the sounds follow each other
                    self.audio_s = 0.0
                return talk.speak(now_s)
            case "audio-chunk":
                self.audio_s += field(message, "audio_s", float, 0.0)
            case "audio-stop" if self.audio_s and talk.state == "speaking":
                return talk.speak(now_s, self.audio_s)
            case "played":
                return talk.end_speech()
            case "error" | "pause-satellite" | "satellite-disconnected":
                return talk.end()
        return ()


@dataclass
class _Wake:
    """A connection that waits for a wake word.

    Attributes:
        name: What it waits for.
        timestamp: Time of the newest audio-chunk.
        is_detected: Whether it was detected in the present audio.
    """

    name: str
    timestamp: int | None = None
    is_detected: bool = False


class Satellite:
    """The connections of a satellite.

    Args:
        link: The head.
    """

    def __init__(self, link: DoorLink) -> None:
        self._link, self._events = link, Wyoming()
        self._sounds: list[SpokenSound] = []
        self._wakes: dict[asyncio.StreamWriter, _Wake] = {}
        self._calls = False

    async def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Read one connection to its end."""
        sound = SpokenSound(self._link)
        if not self._sounds:  # so that the first sound does not wait for the loudspeaker
            sound.add(bytes(640 * WIDTH), 16_000)
            sound.end()
        self._sounds.append(sound)
        try:
            while (event := await _read_event(reader)) is not None:
                if event.type in ("describe", "ping"):
                    await _answer(event, writer, self._link.watches)
                elif event.type == "detect" or writer in self._wakes:
                    await self._follow_wake(event, writer)
                else:
                    self._take(event, sound)
                    if event.type == "audio-stop" and (heard := sound.end()) is not None:
                        self._link.begin(self._report_played(sound, heard, writer))
        except (ConnectionError, asyncio.IncompleteReadError, asyncio.CancelledError):
            pass  # it has disconnected, or the door ends
        except Exception as error:  # of the package: it checks no field
            self._link.report(
                f"a connection is closed, because it sent no Wyoming event ({error}); check the "
                "neighbour's address and version"
            )
        finally:
            sound.end()
            self._sounds.remove(sound)
            self._wakes.pop(writer, None)
            if not self._sounds:
                self._link.send(self._events.talk.end())
            writer.close()

    def _take(self, event: Any, sound: SpokenSound) -> None:
        """Follow an event, and let the head say the sound."""
        from wyoming.audio import AudioChunk, AudioChunkConverter

        message: dict[str, Any] = {"type": event.type, "data": event.data}
        if event.type == "audio-chunk":
            chunk = AudioChunk.from_event(event)
            message["audio_s"] = chunk.seconds
            if self._events.talk.state == "speaking":  # it is not interrupted
                pcm = AudioChunkConverter(width=WIDTH).convert(chunk).audio
                sound.add(pcm, chunk.rate, chunk.channels)
        orders = self._events.take(message, self._link.now_s())
        self._link.send(orders)
        if any(order.state == "interrupt" for order in orders):
            for one in self._sounds:
                one.shut()

    async def _report_played(
        self, sound: SpokenSound, heard: "asyncio.Task[None]", writer: asyncio.StreamWriter
    ) -> None:
        """Tell the neighbour when a sound has been heard; it may have disconnected before."""
        from wyoming.event import async_write_event
        from wyoming.snd import Played

        await heard
        if sound.heard is heard:  # no other one follows
            self._link.send(self._events.take({"type": "played"}, self._link.now_s()))
        with suppress(ConnectionError):
            await async_write_event(Played().event(), writer)

    async def address(self, person: int | None) -> None:
        """Detect the wake word for all that wait, once whenever a person addresses the head."""
        self._calls = person is not None
        for writer in tuple(self._wakes) if self._calls else ():
            with suppress(ConnectionError):
                await self._detect(writer)

    async def _detect(self, writer: asyncio.StreamWriter) -> None:
        from wyoming.event import async_write_event
        from wyoming.wake import Detection

        wake, self._calls = self._wakes[writer], False
        wake.is_detected = True
        await async_write_event(Detection(wake.name, wake.timestamp).event(), writer)

    async def _follow_wake(self, event: Any, writer: asyncio.StreamWriter) -> None:
        """Follow an event of a connection that waits for a wake word; its sound is not said."""
        from wyoming.event import async_write_event
        from wyoming.wake import Detect, NotDetected

        if event.type == "detect":
            self._wakes[writer] = _Wake((Detect.from_event(event).names or [_WAKE])[0])
        wake = self._wakes[writer]
        if event.type == "audio-chunk":
            wake.timestamp = event.data.get("timestamp")
        elif event.type == "audio-stop" and not wake.is_detected:
            await async_write_event(NotDetected().event(), writer)
        elif event.type != "audio-stop":
            wake.is_detected = False
            if self._calls:
                await self._detect(writer)


async def _read_event(reader: asyncio.StreamReader) -> Any:
    """Return the next event, None at the end of the connection.

    Raises:
        ValueError: it is none.
    """
    from wyoming.event import async_read_event

    event = await async_read_event(reader)
    if event is None and not reader.at_eof():
        raise ValueError("not a line of JSON, or too long")
    return event


async def _answer(event: Any, writer: asyncio.StreamWriter, wakes: bool) -> None:
    """Answer a question about the service; wakes: whether it is a wake service."""
    from wyoming.event import async_write_event
    from wyoming.ping import Ping, Pong

    if event.type == "ping":
        answer = Pong(text=Ping.from_event(event).text).event()
    else:
        answer = _info(wakes)
    await async_write_event(answer, writer)


def _info(wakes: bool) -> Any:
    """Return the event that describes the service."""
    from wyoming.audio import AudioFormat
    from wyoming.info import Attribution, Info, SndProgram, WakeModel, WakeProgram

    about: dict[str, Any] = {
        "attribution": Attribution("gazerig", "https://pypi.org/project/gazerig"),
        "installed": True, "version": gazerig.__version__,
    }  # fmt: skip
    snd = SndProgram(
        "gazerig",
        description="A head that speaks",
        snd_format=AudioFormat(22_050, WIDTH, 1),
        **about,
    )
    look = WakeModel(_WAKE, description=_LOOK, phrase=_LOOK, languages=[], **about)
    wake = WakeProgram("gazerig", description="A head that is looked at", models=[look], **about)
    return Info(snd=[snd], wake=[wake] if wakes else []).event()


async def serve(link: DoorLink) -> None:
    """Serve satellites for ever.

    Raises:
        gazerig.Error: the package wyoming is missing.
        OSError: the port is not free.
    """
    try:
        import wyoming  # noqa: F401
    except ImportError as error:
        raise gazerig.Error(f"{error}: pip install 'gazerig[doors]'") from None
    host, port = Address.parse(link.bind)
    satellite = Satellite(link)
    server = await asyncio.start_server(satellite.accept, host, port, limit=_MAX_LINE)
    wake_uri = ", --wake-uri" if link.watches else ""
    link.report(
        f"waiting for a Wyoming satellite on tcp://{link.bind} (--snd-uri, --event-uri{wake_uri})"
    )
    try:
        with link.on_addressed(satellite.address):
            await asyncio.Event().wait()
    finally:
        server.close()


DOOR = Door(
    "wyoming", serve, "Wyoming satellites of Rhasspy and Home Assistant: the head is their loudspeaker",
    bind="127.0.0.1:10601",
)  # fmt: skip
