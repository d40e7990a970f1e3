"""Films and still images; a film's times, order and rotation are those of its container."""

from collections.abc import Iterator
from contextlib import suppress
from functools import partial

import av
import av.container
import cv2
import numpy as np

from gazerig.drivers.camera.file_player import FilePlayer, StoredFrame
from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.camera.source import Shot, to_bgr
from gazerig.drivers.errors import CameraError
from gazerig.drivers.files.file_input import open_regular

_STILL_S = 0.1
_ASSUMED_RATE_HZ = 25
"""Rate of frames without time stamps."""
_LEAST_COMPLETE = 0.95
"""Share of the stated duration that a complete film has; headers are not exact."""


class Film(FilePlayer):
    """A film, or a still image that is shown ten times a second; PyAV and OpenCV read them."""

    is_film = True
    _is_damaged = False

    def play_once(self) -> Iterator[StoredFrame]:
        """Open the file and return its frames.

        Raises:
            CameraError: it is absent, is not a film or image, or is cut short.
        """
        try:
            open_regular(self.path).close()
        except OSError as error:
            raise CameraError(
                f"no readable film or image at {self.path} ({error.strerror}): check the path"
            ) from error
        # OpenCV would return only the first frame of a GIF.
        if self.path.suffix.lower() != ".gif" and cv2.haveImageReader(str(self.path)):
            return _still_frames(self._still())
        if self.number == 0:
            self._check_complete()
        return self._film_frames()

    def _still(self) -> Shot:
        image = None
        with quiet_opencv(), suppress(cv2.error):
            image = cv2.imread(str(self.path), cv2.IMREAD_COLOR)
        pixels = to_bgr(image)
        if pixels is None:
            raise CameraError(
                f"{self.path} is a damaged or too large image: save it again, or scale it down"
            )
        return Shot(0.0, 0, pixels)

    def _open(self) -> av.container.InputContainer:
        try:
            container = av.open(f"file:{self.path}")
        except (av.FFmpegError, OSError) as error:
            raise self._unreadable() from error
        if not container.streams.video:
            container.close()
            raise self._unreadable()
        return container

    def _unreadable(self) -> CameraError:
        return CameraError(
            f"{self.path} is not a readable film or image (or is cut short): "
            "play it in another program, convert it to mp4 or copy it again"
        )

    def _check_complete(self) -> None:
        """Compare the last packet with the duration that the file states."""
        with self._open() as container:
            stream = container.streams.video[0]
            if stream.duration is not None:
                stated_s = float(stream.duration * (stream.time_base or 0))
            elif container.duration is not None and len(container.streams) == 1:
                stated_s = container.duration / av.time_base
            else:
                return
            # FFmpeg takes the duration of an AVI without index from the size of the file.
            length_s = max(stated_s, float(stream.frames / (stream.average_rate or 1)))
            reached_s = 0.0
            try:
                container.seek(int(stated_s * av.time_base))
                for packet in container.demux(stream):
                    if packet.pts is not None and packet.size:
                        end = (packet.pts + (packet.duration or 0)) * packet.time_base
                        reached_s = max(reached_s, float(end))
            except (av.FFmpegError, OSError):
                return  # a file that cannot be searched
        reached_s = min(reached_s, stated_s)
        if reached_s < _LEAST_COMPLETE * length_s - _STILL_S:
            raise CameraError(
                f"{self.path} is cut short after {reached_s:.1f} of {length_s:.1f} s: "
                "copy it again or convert it"
            )

    def _film_frames(self) -> Iterator[StoredFrame]:
        with self._open() as container:
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            usual_s = float(1 / (stream.average_rate or _ASSUMED_RATE_HZ))
            packets = container.demux(stream)
            first_s, start_s = 0.0, -1.0
            while True:
                try:
                    packet = next(packets, None)
                    pictures = [] if packet is None else packet.decode()
                except av.FFmpegError:
                    if not self._is_damaged:
                        self._is_damaged = True
                        self._events.append(
                            f"{self.path.name} is damaged: the damaged frames are skipped"
                        )
                    continue
                for picture in pictures:
                    time_s = picture.time
                    if start_s < 0.0:
                        first_s, start_s = time_s or 0.0, 0.0
                    elif time_s is None or time_s - first_s <= start_s:
                        start_s += usual_s
                    else:
                        start_s = time_s - first_s
                    yield StoredFrame(start_s, partial(_upright, picture))
                if packet is None:
                    return


def _still_frames(shot: Shot) -> Iterator[StoredFrame]:
    number = 0
    while True:
        yield StoredFrame(number * _STILL_S, lambda: shot)
        number += 1


def _upright(picture: av.VideoFrame) -> Shot:
    """Return a picture turned as its container says."""
    quarters = round(picture.rotation / 90) % 4
    pixels = np.asarray(picture.to_ndarray(format="bgr24"), np.uint8)
    image = np.ascontiguousarray(np.rot90(pixels, quarters))
    image.setflags(write=False)
    return Shot(0.0, 0, image)
