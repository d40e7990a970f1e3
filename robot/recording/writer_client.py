"""Client of the process that writes a recording; its calls do not wait.

Messages that the socket does not accept stay in a queue. If the queue is full, further
messages are lost, which is reported. If the process has died, the calls have no effect.
"""

import os
import pickle
import select
import socket
import subprocess
from collections import deque
from typing import NamedTuple

from gazerig.drivers.process import child_process
from gazerig.drivers.process.passed_image import send
from gazerig.robot.recording import writer_process as writer
from gazerig.robot.recording.run_writer import WrittenFile

QUEUE_BYTES = 64_000_000
"""Limit of the queue: some minutes of a run."""

IMAGE_BYTES = 64_000_000
"""Separate limit of the images in the queue: half a minute of a webcam's."""

_TRIES = 8  # most messages per call, so that a writer that recovers delays no tick
_TIMEOUT_S = 15.0


class _QueuedMessage(NamedTuple):
    """A queued message: its bytes, and an image's file descriptor and size, or -1 and 0."""

    data: bytes
    fd: int = -1
    image_bytes: int = 0


class WriterClient:
    """The writing process and the queue of its messages.

    Attributes:
        failed: Reason why nothing more is written, or "".
        done: Size of the recording, None until the process has ended.
    """

    def __init__(self, patient: bool) -> None:
        """Create a client without a process.

        Args:
            patient: Whether to wait for a slow writer.
        """
        self._patient = patient
        self._socket: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._queue: deque[_QueuedMessage] = deque()
        self._queued = self._images = 0
        self.failed = ""
        self.done: WrittenFile | None = None

    def open(self, file_fd: int) -> None:
        """Start the process that writes to an open file, without waiting."""
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
        """Return whether the writer is connected."""
        return self._socket is not None

    def post(self, kind: bytes, body: bytes) -> bool:
        """Send or queue a message; return False if it is lost.

        Each message wakes the writer, which takes the loop longer than creating the message. So one
        large message is better than several small ones.
        """
        if self._socket is None or self._queued > QUEUE_BYTES:
            return False
        data = kind + body
        for at in range(0, len(data), writer.PIECE_BYTES):
            last = at + writer.PIECE_BYTES >= len(data)
            piece = data[at : at + writer.PIECE_BYTES]
            self._enqueue(_QueuedMessage((writer.LAST if last else writer.MORE) + piece))
        self._send_waiting()
        return True

    def post_image(self, body: bytes, fd: int, image_bytes: int) -> bool:
        """Send or queue an image's description and memory; return False if it is lost.

        This class closes the file descriptor.
        """
        if self._socket is None or self._images > IMAGE_BYTES:
            os.close(fd)
            return False
        self._enqueue(_QueuedMessage(writer.LAST + writer.FRAME + body, fd, image_bytes))
        self._send_waiting()
        return True

    def _enqueue(self, piece: _QueuedMessage) -> None:
        self._queue.append(piece)
        self._queued += len(piece.data)
        self._images += piece.image_bytes

    def _send_waiting(self) -> None:
        """Send queued messages that the socket accepts; a patient client waits for the rest."""
        self._send(_TRIES)
        if self._patient and self._queue:
            self.drain()

    def drain(self) -> None:
        """Wait until the writer has accepted everything, with a timeout."""
        while self._queue and self._socket is not None:
            if not select.select([], [self._socket], [], _TIMEOUT_S)[1]:
                self._lose("its writer does not respond")
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
            kind, values = pickle.loads(message)
            if kind == writer.DONE:
                self.done = WrittenFile(*values)
            else:
                self.failed = self.failed or str(values)

    def close(self) -> None:
        """Signal the end of the recording, and wait until the writer has closed the file."""
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
        """Send queued messages, the oldest first, until the socket accepts no more."""
        while self._socket is not None and self._queue and most > 0:
            piece = self._queue[0]
            try:
                send(self._socket, piece.data, piece.fd)
            except BlockingIOError:
                return
            except OSError:
                self.listen()  # it may have sent the reason
                self._lose("its writer has died")
                return
            self._forget(self._queue.popleft())
            most -= 1

    def _forget(self, piece: _QueuedMessage) -> None:
        """Free the resources of a queued message."""
        self._queued -= len(piece.data)
        self._images -= piece.image_bytes
        if piece.fd >= 0:
            os.close(piece.fd)

    def _lose(self, why: str) -> None:
        """Continue without the writer."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        while self._queue:
            self._forget(self._queue.popleft())
        if self.done is None:
            self.failed = self.failed or why
