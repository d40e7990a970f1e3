"""The loop's side of the process that writes a recording: hands over and never waits.

What the socket does not take stays in a queue until it does. Beyond the queue's bound
what is handed over is lost, which is reported. Without the process all goes on.
"""

import os
import pickle
import select
import socket
import subprocess
from collections import deque
from typing import Any, NamedTuple

from gazerig.drivers.process import child_process
from gazerig.drivers.process.passed_image import send
from gazerig.robot.recording import writer_process as writer
from gazerig.robot.recording.run_writer import WrittenFile

QUEUE_BYTES = 64_000_000
"""What waits at most: some minutes of a run."""

IMAGE_BYTES = 64_000_000
"""Images that wait at most, beside it: half a minute of a webcam's."""

_TRIES = 8  # messages sent in one go at most, so that a writer that is back costs no tick
_TIMEOUT_S = 15.0


class _Piece(NamedTuple):
    """A message that waits: its bytes, and an image's file descriptor and size, or -1 and 0."""

    data: bytes
    fd: int = -1
    image_bytes: int = 0


class WriterClient:
    """A process that writes, and what waits for it.

    failed: why nothing more is written, or ""; done: what was written, once it has ended
    """

    def __init__(self, patient: bool) -> None:
        """Prepare; ``patient``: wait for the writer where it is behind."""
        self._patient = patient
        self._socket: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._queue: deque[_Piece] = deque()
        self._queued = self._images = 0
        self.failed = ""
        self.done: WrittenFile | None = None

    def open(self, file_fd: int) -> None:
        """Start the process that writes to an open file; returns at once."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        with theirs:
            self._process = child_process.start(
                writer.__name__,
                str(theirs.fileno()),
                str(file_fd),
                stderr=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(), file_fd),
            )
        ours.setblocking(False)
        self._socket = ours

    @property
    def alive(self) -> bool:
        """Return whether there is a writer to send to."""
        return self._socket is not None

    def post(self, kind: bytes, body: bytes) -> bool:
        """Send something, or have it wait until it is taken; False where it is lost.

        Every message wakes the writer, which costs the loop more than making it: so many small
        things are better one.
        """
        if self._socket is None or self._queued > QUEUE_BYTES:
            return False
        data = kind + body
        for at in range(0, len(data), writer.PIECE_BYTES):
            last = at + writer.PIECE_BYTES >= len(data)
            piece = data[at : at + writer.PIECE_BYTES]
            self._enqueue(_Piece((writer.LAST if last else writer.MORE) + piece))
        self._send_waiting()
        return True

    def post_image(self, body: bytes, fd: int, image_bytes: int) -> bool:
        """Send an image's description and its memory; False where it is lost.

        The file descriptor is closed here.
        """
        if self._socket is None or self._images > IMAGE_BYTES:
            os.close(fd)
            return False
        self._enqueue(_Piece(writer.LAST + writer.FRAME + body, fd, image_bytes))
        self._send_waiting()
        return True

    def _enqueue(self, piece: _Piece) -> None:
        self._queue.append(piece)
        self._queued += len(piece.data)
        self._images += piece.image_bytes

    def _send_waiting(self) -> None:
        """Send what waits, as far as it is taken; a patient client waits for the rest."""
        self._send(_TRIES)
        if self._patient and self._queue:
            self.drain()

    def drain(self) -> None:
        """Wait until the writer has taken everything, or for long enough."""
        while self._queue and self._socket is not None:
            if not select.select([], [self._socket], [], _TIMEOUT_S)[1]:
                self._lose("its writer does not go on")
                return
            self._send(len(self._queue))

    def listen(self) -> None:
        """Receive the messages of the writer."""
        while self._socket is not None:
            try:
                message = self._socket.recv(writer.PIECE_BYTES)
            except BlockingIOError:
                return
            except OSError:
                message = b""
            if not message:
                self._lose("its writer has died")
                return
            self._receive(*pickle.loads(message))

    def close(self) -> None:
        """Send the end of the recording to the writer, and wait until it has closed the file."""
        self.drain()
        if self._socket is not None:
            self._socket.shutdown(socket.SHUT_WR)
            while self._socket is not None:
                if not select.select([self._socket], [], [], _TIMEOUT_S)[0]:
                    self._lose("its writer does not end")
                self.listen()
        if self._process is not None:
            try:
                self._process.wait(_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
            self._process = None

    def _send(self, most: int) -> None:
        """Send what waits, the oldest first, as far as the socket takes it."""
        while self._socket is not None and self._queue and most > 0:
            piece = self._queue[0]
            try:
                send(self._socket, piece.data, piece.fd)
            except BlockingIOError:
                return
            except OSError:
                self.listen()  # it may have said why
                self._lose("its writer has died")
                return
            self._forget(self._queue.popleft())
            most -= 1

    def _forget(self, piece: _Piece) -> None:
        """Free what a piece has occupied while it waited."""
        self._queued -= len(piece.data)
        self._images -= piece.image_bytes
        if piece.fd >= 0:
            os.close(piece.fd)

    def _receive(self, kind: str, values: Any) -> None:
        if kind == writer.DONE:
            self.done = WrittenFile(*values)
        else:
            self.failed = self.failed or str(values)

    def _lose(self, why: str) -> None:
        """Go on without the writer."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        while self._queue:
            self._forget(self._queue.popleft())
        if self.done is None:
            self.failed = self.failed or why
