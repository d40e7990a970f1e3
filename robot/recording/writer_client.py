"""The loop's side of the process that writes a recording: hands over and never waits.

What the socket does not take stays in a queue until it does. Beyond the queue's bound
what is handed over is lost, which is reported. Without the process all goes on.
"""

import pickle
import select
import socket
import subprocess
from collections import deque
from typing import Any

from gazerig.drivers import child_process
from gazerig.robot.recording import writer_process as writer
from gazerig.robot.recording.run_writer import WrittenFile

QUEUE_BYTES = 64_000_000
"""What waits at most: some minutes of a run."""

_TRIES = 8  # messages sent in one go at most, so that a writer that is back costs no tick
_TIMEOUT_S = 15.0


class WriterClient:
    """A process that writes, and what waits for it.

    failed: why nothing more is written, or ""; done: what was written, once it has ended
    """

    def __init__(self, patient: bool) -> None:
        """Prepare; ``patient``: wait for the writer where it is behind."""
        self._patient = patient
        self._socket: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._batch: list[bytes] = []
        self._queue: deque[bytes] = deque()
        self._queued = 0
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

    def post(self, kind: str, values: Any) -> bool:
        """Hand something over with the next ``flush``; False where it is lost."""
        if self._socket is None or self._queued > QUEUE_BYTES:
            return False
        data = pickle.dumps((kind, values), pickle.HIGHEST_PROTOCOL)
        self._batch.append(data)
        self._queued += len(data)
        return True

    def flush(self) -> None:
        """Send what was handed over, as far as it is taken; what is not waits.

        Every message wakes the writer, which costs the loop more than making it: so it is
        better called some times a second than with every tick.
        """
        data = b"".join(self._batch)
        self._batch.clear()
        for at in range(0, len(data), writer.PIECE_BYTES):
            last = at + writer.PIECE_BYTES >= len(data)
            piece = data[at : at + writer.PIECE_BYTES]
            self._queue.append((writer.LAST if last else writer.MORE) + piece)
        self._send(_TRIES)
        if self._patient and self._queue:
            self.drain()

    def drain(self) -> None:
        """Wait until the writer has taken everything, or for long enough."""
        if self._batch:
            self.flush()
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
            try:
                self._socket.send(self._queue[0])
            except BlockingIOError:
                return
            except OSError:
                self.listen()  # it may have said why
                self._lose("its writer has died")
                return
            self._queued -= len(self._queue.popleft()) - 1
            most -= 1

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
        self._batch.clear()
        self._queue.clear()
        self._queued = 0
        if self.done is None:
            self.failed = self.failed or why
