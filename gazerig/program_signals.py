"""Signal handlers of a program with open heads: the heads park before the program ends."""

import ctypes
import os
import signal
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import thread as pool_threads
from types import FrameType
from typing import Protocol

from gazerig.robot.loop.power_down import SAME_REQUEST_S
from gazerig.robot.model.clock import RealClock

_ENDING = (signal.SIGTERM, signal.SIGHUP)
_ENDS = (KeyboardInterrupt, SystemExit)
_DEFAULTS = (signal.SIG_DFL, signal.default_int_handler)


def is_left_waiting_for(worker: threading.Thread) -> bool:
    """Return whether the program is ending, and waits for a thread of a pool to end first.

    A pool (``concurrent.futures``, ``asyncio.to_thread``) waits for its threads when it is shut
    down, by its block, a call or the event loop, and the interpreter does so before the main thread
    counts as ended. Ctrl-C, which only the main thread gets, therefore never reaches their work.
    """
    if pool_threads._shutdown:
        return worker in pool_threads._threads_queues
    # An exception that the program may handle ends neither the program nor the work.
    handled = sys._current_exceptions().get(threading.main_thread().ident or 0)
    error = handled[1] if isinstance(handled, tuple) else handled  # a tuple up to Python 3.11
    if not isinstance(error, _ENDS):
        return False
    return any(_shuts_down_pool_of(worker, frame) for frame in sys._current_frames().values())


def _shuts_down_pool_of(worker: threading.Thread, frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code is ThreadPoolExecutor.shutdown.__code__:
            return worker in tuple(frame.f_locals["self"]._threads)
        frame = frame.f_back
    return False


def interrupt(worker: threading.Thread) -> None:
    """Raise KeyboardInterrupt in a thread, as Ctrl-C does in the main thread.

    It arrives with the next line of Python that the thread executes.
    """
    if worker.ident is not None and worker.is_alive():
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(worker.ident), ctypes.py_object(KeyboardInterrupt)
        )


class OpenHead(Protocol):
    """A head whose loop runs."""

    closing: bool
    """The block has ended, and waits until the head has parked."""

    def end(self, reason: str) -> None:
        """Ask the head to park; a second call skips the rest of parking."""


class ProgramSignals:
    """Handlers for SIGINT, SIGTERM and SIGHUP while heads are open.

    Only handlers that are still at their defaults are replaced. Ctrl-C raises KeyboardInterrupt as
    usual. While a head parks, it skips the rest of parking instead, so that the program never ends
    with the torque on, after any number of signals. SIGTERM and SIGHUP make every open head park
    and raise SystemExit(128 + number) in the main thread.
    """

    def __init__(self) -> None:
        self._heads: list[OpenHead] = []
        self._installed: list[signal.Signals] = []
        self._last_s = -SAME_REQUEST_S
        self._clock = RealClock()

    def add(self, head: OpenHead) -> None:
        """Register an open head; only the main thread can set handlers."""
        self._heads.append(head)
        if threading.current_thread() is not threading.main_thread():
            return
        for number in (signal.SIGINT, *_ENDING):
            if signal.getsignal(number) in _DEFAULTS:
                signal.signal(number, self._handle)
                self._installed.append(number)

    def remove(self, head: OpenHead) -> None:
        """Remove a head that has ended; after the last one, restore the default handlers."""
        if head in self._heads:
            self._heads.remove(head)
        if self._heads or threading.current_thread() is not threading.main_thread():
            return
        self._restore()

    def forget(self) -> None:
        """Drop heads and handlers in a forked process; they belong to its parent."""
        self._heads.clear()
        self._restore()

    def _restore(self) -> None:
        while self._installed:
            number = self._installed.pop()
            if signal.getsignal(number) == self._handle:
                default = signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL
                signal.signal(number, default)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        now_s, last_s = self._clock.now_s(), self._last_s
        self._last_s = now_s
        name = signal.Signals(number).name
        # While the interpreter exits, an exception would end the loops of heads that are still
        # open.
        final = not threading.main_thread().is_alive()
        closing = [head for head in self._heads if head.closing or final]
        if closing and now_s - last_s < SAME_REQUEST_S:
            return  # a shell and a runner may both send the same signal
        if number != signal.SIGINT and not closing:
            closing = [*self._heads]
            for head in closing:
                head.end(name)
            raise SystemExit(128 + number)
        for head in closing:
            head.end(name)
        if not closing:
            raise KeyboardInterrupt


SIGNALS = ProgramSignals()
"""One instance, because signal handlers belong to the whole process."""

os.register_at_fork(after_in_child=SIGNALS.forget)
