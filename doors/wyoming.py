"""Door to Wyoming, the protocol of Rhasspy and Home Assistant: a ``snd`` service.

The head plays the sound and moves its mouth by it. The same port accepts the events of a satellite
(``--event-uri``): detection, voice-started and -stopped, transcript, synthesize. Events:
github.com/OHF-Voice/wyoming; the package ``wyoming`` reads and writes them.
"""

import asyncio
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import gazerig
from gazerig.doors.admission import MOST, user_refusal
from gazerig.doors.door import Address, Door, DoorLink
from gazerig.doors.spoken_sound import WIDTH, SpokenSound
from gazerig.doors.turn_taking import Orders, TurnTaking, field

_MAX_CHUNKS = 64
"""Chunks of sound that wait; a neighbour that sends more is slowed down."""
_AHEAD_S = 1.0
"""Sound that the head has before it is heard."""
_MAX_BYTES, _MAX_LINE = 1_000_000, 65_536


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


def _limit_events(reader: asyncio.StreamReader) -> None:
    """Let a stream refuse to read a huge event."""
    read = reader.readexactly

    async def read_limited(n: int) -> bytes:
        if not isinstance(n, int) or n > _MAX_BYTES:
            raise ValueError(f"an event of {n} bytes; the limit is {_MAX_BYTES}")
        return await read(n)

    reader.readexactly = read_limited  # type: ignore[method-assign]


class Satellite:
    """The connections of a satellite.

    Args:
        link: The head.
    """

    def __init__(self, link: DoorLink) -> None:
        self._link, self._events = link, Wyoming()
        self._sounds: list[asyncio.Queue[Any]] = []
        self._said = set[SpokenSound]()
        self._opening: asyncio.Future[str] | None = None

    async def accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Read one connection to its end."""
        refused = user_refusal(self._link.bind, writer.transport)
        if not refused and len(self._sounds) >= MOST:
            refused = f"more than {MOST} connections at once: the newest is refused"
        if refused:
            self._link.report(refused)
            await _refuse(writer, refused)
            return
        _limit_events(reader)
        sounds: asyncio.Queue[Any] = asyncio.Queue(_MAX_CHUNKS)
        if self._opening is None:  # so that the first sound does not wait for the loudspeaker
            silence = SpokenSound(16_000, 1)
            silence.feed(bytes(640 * WIDTH))
            silence.end()
            self._opening = asyncio.ensure_future(
                asyncio.to_thread(silence.say, self._link.connect)
            )
        self._sounds.append(sounds)
        player = asyncio.ensure_future(self._play(sounds, writer))
        try:
            await self._read(reader, writer, sounds)
        except (ConnectionError, asyncio.IncompleteReadError):
            pass  # it has disconnected
        except (ValueError, AttributeError, KeyError, TypeError) as error:
            self._link.report(
                f"a connection is closed, because it sent no Wyoming event ({error}); check the "
                "neighbour's address and version"
            )
        finally:
            player.cancel()
            await asyncio.gather(player, return_exceptions=True)
            self._sounds.remove(sounds)
            if not self._sounds:
                self._link.send(self._events.talk.end())
            writer.close()

    def _report_sound(self, refused: str) -> None:
        if refused:
            self._link.report(f"no sound is heard: {refused}")

    async def _read(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, sounds: asyncio.Queue[Any]
    ) -> None:  # fmt: skip
        """Read events until the connection ends.

        Raises:
            ValueError, AttributeError, KeyError, TypeError: an event is malformed.
        """
        from wyoming.audio import AudioChunk, AudioStart
        from wyoming.event import async_read_event, async_write_event

        while True:
            event = await async_read_event(reader)
            if event is None:
                if not reader.at_eof():
                    raise ValueError("not a line of JSON, or too long")
                return
            if event.type == "describe":
                await async_write_event(_info(), writer)
                continue
            if event.type == "ping":
                from wyoming.ping import Ping, Pong

                await async_write_event(Pong(text=Ping.from_event(event).text).event(), writer)
                continue
            message: dict[str, Any] = {"type": event.type, "data": event.data}
            if event.type == "audio-start":
                await sounds.put(_check_audio(AudioStart.from_event(event)))
            elif event.type == "audio-chunk":
                chunk = _check_audio(AudioChunk.from_event(event))
                message["audio_s"] = chunk.seconds
                await sounds.put(chunk)
            elif event.type == "audio-stop":
                await sounds.put(None)
            orders = self._events.take(message, self._link.now_s())
            self._link.send(orders)
            if any(order.state == "interrupt" for order in orders):
                for sound in self._said:
                    sound.cut()
                for waiting in self._sounds:
                    while not waiting.empty():
                        waiting.get_nowait()
                    waiting.put_nowait(None)

    async def _play(self, sounds: asyncio.Queue[Any], writer: asyncio.StreamWriter) -> None:
        """Let the head say the sounds of a connection, at the pace at which they are heard."""
        from wyoming.audio import AudioChunk, AudioChunkConverter
        from wyoming.event import async_write_event
        from wyoming.snd import Played

        while True:
            start = await sounds.get()
            if start is None or isinstance(start, AudioChunk):
                continue
            link, channels = self._link, start.channels
            convert = AudioChunkConverter(start.rate, WIDTH, channels).convert
            sound = SpokenSound(start.rate, channels)
            if self._opening is not None:
                self._report_sound(await asyncio.shield(self._opening))
            self._said.add(sound)
            saying = asyncio.ensure_future(asyncio.to_thread(sound.say, link.connect))
            begin_s, sent_s = link.now_s(), 0.0
            try:
                while (chunk := await sounds.get()) is not None:
                    if not isinstance(chunk, AudioChunk):
                        continue
                    for piece, seconds in sound.split(convert(chunk).audio):
                        if not sound.is_cut:
                            sound.feed(piece)
                            sent_s += seconds
                            await asyncio.sleep(begin_s + sent_s - _AHEAD_S - link.now_s())
            finally:
                sound.end()
                self._said.discard(sound)
            self._report_sound(await saying)
            if not sent_s:  # an event of a satellite that has another loudspeaker
                continue
            if not sound.is_cut:
                await asyncio.sleep(begin_s + sent_s - link.now_s())
            if sounds.empty():
                link.send(self._events.take({"type": "played"}, link.now_s()))
            with suppress(ConnectionError):
                await async_write_event(Played().event(), writer)


async def _refuse(writer: asyncio.StreamWriter, reason: str) -> None:
    """Tell a neighbour why it is disconnected."""
    from wyoming.error import Error
    from wyoming.event import async_write_event

    with suppress(ConnectionError):
        await async_write_event(Error(text=reason).event(), writer)
    writer.close()


def _check_audio(sound: Any) -> Any:
    """Return an AudioStart or AudioChunk.

    Raises:
        ValueError: the samples cannot be read.
    """
    rate, width, channels = sound.rate, sound.width, sound.channels
    if not (8_000 <= rate <= 192_000 and width in (1, 2, 4) and channels in (1, 2)):
        raise ValueError(f"audio of {channels} channels, {width} bytes, {rate} Hz")
    if len(getattr(sound, "audio", b"")) % (width * channels):
        raise ValueError("an audio-chunk with a part of a sample")
    return sound


def _info() -> Any:
    """Return the event that describes the service."""
    from wyoming.audio import AudioFormat
    from wyoming.info import Attribution, Info, SndProgram

    owner = Attribution("gazerig", "https://pypi.org/project/gazerig")
    program = SndProgram(
        name="gazerig", attribution=owner, installed=True, version=gazerig.__version__,
        description="A head that speaks", snd_format=AudioFormat(22_050, WIDTH, 1),
    )  # fmt: skip
    return Info(snd=[program]).event()


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
    server = await asyncio.start_server(Satellite(link).accept, host, port, limit=_MAX_LINE)
    link.report(f"waiting for a Wyoming satellite on tcp://{link.bind} (--snd-uri, --event-uri)")
    try:
        await asyncio.Event().wait()
    finally:
        server.close()


DOOR = Door(
    "wyoming", serve, "Wyoming satellites of Rhasspy and Home Assistant: the head is their loudspeaker",
    bind="127.0.0.1:10601",
)  # fmt: skip
