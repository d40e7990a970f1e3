"""Playback of a camera recording: the same frames at the same intervals."""

import struct
import threading
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from statistics import median
from typing import NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Header, Message

from gazerig.drivers.camera import recording_format as fmt
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.video_file import VideoPacing, VideoTimestamps
from gazerig.drivers.errors import CameraError
from gazerig.drivers.files.file_input import MAGIC, open_mcap

_HEAD = 9  # bytes of a record before its content: kind and length
_LARGEST = 1 << 30  # bytes of a message; more is damage
_CURE = "make one with gazerig run --record-camera; use --video for films"
_FIXED = 22  # bytes of a message before its data


class _MessagePlace(NamedTuple):
    """Position of a record's content in the file."""

    offset: int
    length: int


class _FrameIndex(NamedTuple):
    """Time of a frame, and the positions of its messages in the file."""

    stamp_ns: int
    places: dict[str, _MessagePlace]


class Recording:
    """An open recording.

    times_s: time of each frame, ascending, the first at 0; note: a problem of the file, or ""
    """

    def __init__(self, path: Path) -> None:
        """Open the file and index its frames.

        Raises:
            CameraError: it is absent, is not a recording, or contains no frame.
        """
        self._path = path
        self._file = open_mcap(path, CameraError, _CURE)
        try:
            self._channels: dict[int, str] = {}
            self._frames: list[_FrameIndex] = []
            ended = self._index()
        except BaseException:
            self._file.close()
            raise
        if not self._frames:
            self._file.close()
            raise CameraError(f"{path} contains no frame: record it again")
        first = self._frames[0].stamp_ns
        self.times_s = tuple((p.stamp_ns - first) / 1e9 for p in self._frames)
        self.note = (
            ""
            if ended
            else (
                f"{path.name} was not closed: its {len(self.times_s)} complete frames can be read"
            )
        )

    def shot(self, index: int) -> Shot:
        """Read a frame, counted from 0, with its time since the first frame.

        Raises:
            CameraError: the file is damaged there.
        """
        places = self._frames[index].places
        try:
            return Shot(
                self.times_s[index],
                index + 1,
                fmt.decode_image(self._data(places[fmt.PICTURE])),
                fmt.decode_depth(self._data(places[fmt.DEPTH])) if fmt.DEPTH in places else None,
                fmt.decode_lens(self._data(places[fmt.LENS])) if fmt.LENS in places else None,
            )
        except (fmt.BadMessage, McapError, OSError, KeyError, ValueError) as error:
            raise CameraError(
                f"frame {index + 1} of {self._path} is damaged ({error}): copy the file again"
            ) from error

    def close(self) -> None:
        """Free the file; safe to call twice."""
        self._file.close()

    def _data(self, place: _MessagePlace) -> bytes:
        """Read the data of a message."""
        self._file.seek(place.offset)
        content = self._file.read(place.length)
        if len(content) < place.length:
            raise fmt.BadMessage("the file ends within it")
        return bytes(Message.read(ReadDataStream(BytesIO(content)), place.length).data)

    def _index(self) -> bool:
        """Index the frames; return whether the file was closed properly."""
        try:
            waiting: dict[str, _MessagePlace] = {}
            stamp_ns = -1
            for kind, place in self._records():
                if kind == Opcode.DATA_END:
                    return True
                if kind in (Opcode.CHUNK, Opcode.HEADER, Opcode.CHANNEL):
                    if kind == Opcode.CHUNK:
                        raise CameraError(
                            f"{self._path} was packed into chunks by another program: "
                            "play the file as recorded"
                        )
                    if kind == Opcode.HEADER:
                        profile = Header.read(self._content(place, place.length)).profile
                        if profile != fmt.PROFILE:
                            raise CameraError(
                                f"{self._path} is not a camera recording of gazerig (its profile is "
                                f"{profile!r}): make one with gazerig run --record-camera"
                            )
                    else:
                        channel = Channel.read(self._content(place, place.length))
                        self._channels[channel.id] = channel.topic
                elif kind == Opcode.MESSAGE:
                    head = Message.read(self._content(place, _FIXED), _FIXED)
                    topic = self._channels.get(head.channel_id, "")
                    if head.log_time != stamp_ns:  # earlier messages belong to no frame
                        stamp_ns, waiting = head.log_time, {}
                    waiting[topic] = place
                    last_ns = self._frames[-1].stamp_ns if self._frames else -1
                    if topic == fmt.PICTURE and stamp_ns > last_ns:
                        self._frames.append(_FrameIndex(stamp_ns, waiting))
            return False
        except (McapError, ValueError, struct.error) as error:
            raise CameraError(f"{self._path} is damaged: copy the file again") from error

    def _records(self) -> Iterator[tuple[int, _MessagePlace]]:
        """Yield the kind and position of each complete record."""
        end = self._path.stat().st_size
        offset = len(MAGIC)
        while offset + _HEAD <= end:
            self._file.seek(offset)
            head = self._file.read(_HEAD)
            kind, length = head[0], int.from_bytes(head[1:], "little")
            if length > _LARGEST:
                raise CameraError(f"{self._path} is damaged after byte {offset}: copy it again")
            if offset + _HEAD + length > end:
                return
            yield kind, _MessagePlace(offset + _HEAD, length)
            offset += _HEAD + length

    def _content(self, place: _MessagePlace, length: int) -> ReadDataStream:
        """Read the beginning of a record's content."""
        self._file.seek(place.offset)
        return ReadDataStream(BytesIO(self._file.read(min(length, place.length))))


_ALONE_S = 0.1  # duration of a recording of one frame


class CameraReplay:
    """A recording, repeated forever like a film; film time starts at 0 with frame 1."""

    def __init__(self, path: str | Path) -> None:
        """Set the path; nothing is opened yet."""
        self._path = Path(path).expanduser()
        self._recording: Recording | None = None
        self._times = VideoTimestamps(1.0)
        self._pace = VideoPacing()
        self._unreported = ""

    def open(self) -> None:
        """Open the file, or open it again at film time 0.

        Raises:
            CameraError: it is absent, is not a recording, or contains no frame.
        """
        self.close()
        self._recording = Recording(self._path)
        starts = self._recording.times_s
        steps = [b - a for a, b in zip(starts, starts[1:], strict=False)]
        length_s = starts[-1] + (median(steps) if steps else _ALONE_S)
        self._times = VideoTimestamps(len(starts) / length_s, starts, length_s)
        self._pace, self._unreported = VideoPacing(), self._recording.note

    @property
    def length_s(self) -> float:
        """Return the duration of one repeat, seconds."""
        self._require_recording()
        return self._times.length_s

    def due_s(self, number: int) -> float:
        """Return the film time at which a frame is due."""
        self._require_recording()
        return self._times.due_s(number)

    def shot(self, number: int) -> Shot:
        """Read a frame by number, with the film time at which it is due.

        Raises:
            CameraError: the file is damaged there.
        """
        recording = self._require_recording()
        found = recording.shot((number - 1) % len(recording.times_s))
        return found._replace(captured_s=self._times.due_s(number), number=number)

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait until the next frame is due, then read the newest; time starts here.

        Raises:
            CameraError: the file is damaged there.
        """
        self._require_recording()
        due = self._pace.wait(self._times, now_s, stop)
        return None if due is None else self.shot(due.number)._replace(captured_s=due.host_s)

    def events(self) -> tuple[str, ...]:
        """Return problems of the file, one line each, once."""
        message, self._unreported = self._unreported, ""
        return (message,) if message else ()

    def close(self) -> None:
        """Free the file; safe to call twice."""
        if self._recording is not None:
            self._recording.close()
        self._recording = None

    def _require_recording(self) -> Recording:
        """Return the open file."""
        if self._recording is None:
            raise CameraError(f"{self._path} is not open: call open() before reading")
        return self._recording
