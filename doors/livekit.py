"""Door to LiveKit Agents: the attribute ``lk.agent.state`` of the agent in a room.

The door joins the room with LIVEKIT_URL and LIVEKIT_TOKEN of its environment, subscribes to the
agent's sound only, which moves the mouth, and publishes nothing. Its events are read by the names
of their fields, so they fit several versions. With addressed, it calls the agent's methods
start_turn, end_turn and cancel_turn, those of LiveKit's example push_to_talk.py.
"""

import asyncio
import os
from collections.abc import AsyncIterator, Callable, Mapping
from typing import Any

import gazerig
from gazerig.doors.door import Door, DoorLink
from gazerig.doors.spoken_sound import SpokenSound
from gazerig.doors.turn_taking import Orders, TurnTaking

ATTRIBUTE = "lk.agent.state"
RATE_HZ = 16_000
"""Rate of the samples that move the mouth."""
_AUDIO = 1
"""``TrackKind.KIND_AUDIO``."""
_URL, _TOKEN = "LIVEKIT_URL", "LIVEKIT_TOKEN"


class LiveKit:
    """States of an agent as orders."""

    def __init__(self) -> None:
        self.talk = TurnTaking("listening")

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for changed attributes of the agent; unknown states are ignored."""
        talk = self.talk
        match message.get(ATTRIBUTE):
            case "thinking":
                return talk.end_speech() + talk.partner_pauses()
            case "speaking":
                return talk.speak(now_s)
            case "listening":
                return talk.end_speech() or talk.partner_speaks()
            case "initializing" | "idle" | "":
                return talk.end()
        return ()


async def follow_room(
    link: DoorLink,
    room: Any,
    token: str,
    options: Any,
    listen: Callable[[Any], AsyncIterator[bytes]],
) -> None:
    """Join a room and follow its agent until the room is closed.

    Args:
        link: The head.
        room: A ``livekit.rtc.Room``.
        token: Access token of a participant who may subscribe.
        options: ``RoomOptions`` without automatic subscription.
        listen: Returns the samples of a track as they are heard, at RATE_HZ, one channel.
    """
    mouth = SpokenSound(link, volume=0.0)
    states, closed, moving = LiveKit(), asyncio.Event(), set[asyncio.Task[None]]()

    def take(message: Mapping[str, str]) -> None:
        link.send(states.take(message, link.now_s()))

    def change(attributes: Mapping[str, str], participant: Any) -> None:
        """Follow changed attributes, and subscribe to the sound of an agent."""
        if ATTRIBUTE in attributes:
            take({ATTRIBUTE: attributes[ATTRIBUTE]})
        if participant is not None and ATTRIBUTE in participant.attributes:
            for publication in participant.track_publications.values():
                if publication.kind == _AUDIO and not publication.subscribed:
                    publication.set_subscribed(True)

    def join(participant: Any) -> None:
        change(participant.attributes, participant)

    async def move_mouth(sounds: AsyncIterator[bytes]) -> None:
        async for pcm in sounds:
            if states.talk.state == "speaking":
                mouth.add(pcm, RATE_HZ)
            else:
                mouth.shut()

    def leave(participant: Any) -> None:
        if ATTRIBUTE in participant.attributes:
            take({ATTRIBUTE: "idle"})

    has_turn = False

    async def tell(person: int | None) -> None:
        """Open or close the turn of the agents, as their push-to-talk does."""
        nonlocal has_turn
        ends, has_turn = has_turn and states.talk.state != "speaking", person is not None
        method = "start_turn" if has_turn else "end_turn" if ends else "cancel_turn"
        for identity, participant in room.remote_participants.items():
            if ATTRIBUTE in participant.attributes:
                try:
                    await room.local_participant.perform_rpc(
                        destination_identity=identity, method=method, payload=""
                    )
                except Exception as error:  # RpcError of the package, which tests do without
                    link.report(
                        f"the agent has not taken the turn ({method}: {error}); register "
                        "start_turn, end_turn and cancel_turn as in docs/talk.md"
                    )

    room.on("participant_attributes_changed", change)
    room.on("participant_connected", join)
    room.on("track_published", lambda publication, participant: change({}, participant))
    room.on(
        "track_subscribed",
        lambda track, *of: moving.add(asyncio.ensure_future(move_mouth(listen(track)))),
    )
    room.on("participant_disconnected", leave)
    room.on("disconnected", lambda *reason: closed.set())
    try:
        await room.connect(link.address, token, options)
        link.report(f"connected to {link.address}")
        for participant in room.remote_participants.values():
            join(participant)
        with link.on_addressed(tell):
            await closed.wait()
    finally:
        link.send(states.talk.end())
        mouth.shut()
        for task in moving:
            task.cancel()
        await room.disconnect()


async def serve(link: DoorLink) -> None:
    """Join the room of the environment's address and token; join again for ever.

    Raises:
        gazerig.Error: the address, the token or the package is missing.
    """
    link.address = link.address or os.environ.get(_URL, "")
    token = os.environ.get(_TOKEN, "")
    if not link.address or not token:
        raise gazerig.Error(
            f"set {_URL}, e.g. ws://127.0.0.1:7880, and {_TOKEN}: lk token create --join "
            "--room ROOM --identity head"
        )
    try:
        from livekit import rtc
    except ImportError as error:
        raise gazerig.Error(f"livekit is missing ({error}): pip install livekit") from None

    async def listen(track: Any) -> AsyncIterator[bytes]:
        async for event in rtc.AudioStream(track, sample_rate=RATE_HZ, num_channels=1):
            yield bytes(event.frame.data)

    options = rtc.RoomOptions(auto_subscribe=False)
    await link.keep(
        lambda: follow_room(link, rtc.Room(), token, options, listen),
        f"a LiveKit room with an agent at {link.address}",
        f"a token lasts for hours only: check {_TOKEN}",
        (OSError, TimeoutError, rtc.ConnectError),
    )


DOOR = Door("livekit", serve, "LiveKit Agents: an agent's state in a room")
