"""Playback of a camera recording: the same frames at the same intervals."""

import struct
from collections.abc import Iterator
from functools import partial

from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, DataEnd, Header, Message
from mcap.stream_reader import StreamReader

from gazerig.drivers.camera import recording_format as fmt
from gazerig.drivers.camera.file_player import FilePlayer, StoredFrame
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError
from gazerig.drivers.files.file_input import open_mcap

_LARGEST = 1 << 30  # bytes of a record; more is damage
_CURE = "make one with gazerig run --record-camera"
Messages = dict[str, bytes]
"""Topic -> data of a frame's message."""


class CameraReplay(FilePlayer):
    """A recording, repeated forever like a film."""

    _is_cut = False

    def play_once(self) -> Iterator[StoredFrame]:
        """Open the file and return its frames; one that is no later than the last is left out.

        Raises:
            CameraError: it is absent, is not a recording, or is damaged.
        """
        first_ns, last_ns = 0, -1
        for index, (stamp_ns, messages) in enumerate(self._stamped_frames()):
            if last_ns < 0:
                first_ns = stamp_ns
            if stamp_ns > last_ns:
                last_ns = stamp_ns
                read = partial(self._decode, index + 1, messages)
                yield StoredFrame((stamp_ns - first_ns) / 1e9, read)

    def _decode(self, number: int, messages: Messages) -> Shot:
        try:
            return fmt.decode_shot(messages)
        except ValueError as error:
            raise CameraError(
                f"frame {number} of {self.path} is damaged ({error}): copy the file again"
            ) from error

    def _stamped_frames(self) -> Iterator[tuple[int, Messages]]:
        """Return the messages of each complete frame with its time."""
        channels: dict[int, str] = {}
        messages: Messages = {}
        stamp_ns = -1
        with open_mcap(self.path, CameraError, _CURE) as file:
            reader = StreamReader(file, True, emit_chunks=True, record_size_limit=_LARGEST)
            try:
                for record in reader.records:
                    is_other = isinstance(record, Header) and record.profile != fmt.PROFILE
                    if is_other or isinstance(record, Chunk):
                        raise CameraError(
                            f"{self.path} is not a camera recording of gazerig, or was packed into "
                            f"chunks by another program: {_CURE}"
                        )
                    if isinstance(record, Channel):
                        channels[record.id] = record.topic
                    elif isinstance(record, Message):
                        if record.log_time != stamp_ns:
                            stamp_ns, messages = record.log_time, {}
                        topic = channels.get(record.channel_id, "")
                        messages[topic] = record.data
                        if topic == fmt.PICTURE:  # the last message of a frame
                            yield stamp_ns, messages
                    elif isinstance(record, DataEnd):
                        return
            except EndOfFile:
                if not self._is_cut:
                    self._is_cut = True
                    self._events.append(
                        f"{self.path.name} was not closed: its complete frames are played"
                    )
            except (McapError, ValueError, struct.error) as error:
                raise CameraError(f"{self.path} is damaged: copy the file again") from error
