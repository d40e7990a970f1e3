"""Heads of this program: in real time in a thread, or in simulated time."""

import contextlib
import logging
import os
import signal
import threading
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, Self

from gazerig.config.faults import ConfigError
from gazerig.drivers.errors import SetupError
from gazerig.drivers.process.work_queue import WorkQueue
from gazerig.errors import Error, HeadEnded, Refused
from gazerig.head import Head, Order
from gazerig.program_signals import SIGNALS, interrupt, is_left_waiting_for
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import HeadEvent, HeadState, head_state
from gazerig.robot.loop.loop import TickLoop
from gazerig.robot.loop.power_down import Interrupts
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import Command, Request, Say, set_client
from gazerig.robot.model.reply import Progress
from gazerig.robot.run.requests import RequestHandler
from gazerig.robot.run.run import Run
from gazerig.robot.run.session import Session

_LOG = logging.getLogger("gazerig")
_ENDED = "the program"
_LINES_S = 1.0
"""Time to deliver the last lines to a program."""


class LocalHead(Head):
    """A head whose control loop is in this program; ``gazerig.open`` creates it.

    Args:
        rig: name or path of the rig.
        make: puts the run together.
        say: receives one line per message; None: ``logging.getLogger("gazerig")``.
    """

    def __init__(
        self,
        rig: str,
        make: Callable[[], Run],
        say: Callable[[str], None] | None = None,
    ) -> None:
        self.rig, self._make = rig, make
        self._say = say if say is not None else _LOG.info
        self._feed = TickFeed()
        self._made: Run | None = None
        self._ended = ""

    @property
    def state(self) -> HeadState:
        """Return the newest tick of the control loop."""
        if self._feed.newest is None:
            self._active_run()
            self._pause(lambda: self._feed.newest is not None, 10.0)
        tick = self._feed.newest
        if tick is None:
            raise HeadEnded("the control loop is not running")
        return head_state(tick)

    def _ask(self, request: Request, kind: Any) -> Any:
        self._active_run()
        with _raising_refused():
            return self._requests.perform(request)

    def _progress(self) -> Progress:
        return self._feed.progress()

    def _events(self, after: int) -> tuple[HeadEvent, ...]:
        return self._feed.events(after)

    def _send(self, command: Command) -> Order:
        robot = self._active_run().robot
        with _raising_refused():
            command = set_client(command, self._who)
            if isinstance(command, Say):
                command = self._active_run().voice.prepare(command)
            ticket = robot.command(command)
        order = Order(self, lambda: ticket.wait(0.0))
        self._feed.follow(order._update_outcome)
        return order

    def _active_run(self) -> Run:
        if self._ended:
            raise HeadEnded(f"the head has ended: {self._ended}")
        if self._made is None:
            raise Error(f"use the head in a with block: with gazerig.open({self.rig!r}) as head:")
        return self._made

    def _make_run(self) -> Run:
        if self._made is not None:
            raise Error("a head can be used in one with block only: open another")
        self._made = run = self._make()
        self._requests = RequestHandler(run, self._feed, {})
        return run


class RunningHead(LocalHead):
    """A head whose loop runs in its own thread, in real time.

    The head parks and switches the torque off, as ``gazerig run`` does, after each of these: the
    end of the block, an exception, Ctrl-C, SIGTERM and SIGHUP (``ProgramSignals``), the end of the
    thread that opened it or of the interpreter, also where they wait for that thread
    (``is_left_waiting_for``). Further signals skip the rest of parking. If the
    program ends abruptly (SIGKILL, a crash), the guardian switches the torque off.

    Attributes:
        closing: the block has ended, and waits until the head has parked.
    """

    def __enter__(self) -> Self:
        """Switch the torque on at the present joint angles; return after the first tick."""
        run = self._make_run()  # first: a second block changes nothing of the first
        self._owner, self._pid = threading.current_thread(), os.getpid()
        self._interrupts = Interrupts(also=self._abandonment_reason, signals=False)
        self._started, self._finished = threading.Event(), threading.Event()
        self._failure: BaseException | None = None
        self.closing, self._ended_by = False, ""
        # Not a daemon thread, so that the interpreter waits for parking before it exits.
        self._thread = threading.Thread(
            target=self._run, args=(run,), name=f"head {self.rig}", daemon=False
        )
        SIGNALS.add(self)
        try:
            self._thread.start()
            while not self._started.wait(0.05) and not self._finished.is_set():
                pass
            if not self._started.is_set():
                raise self._failure if self._failure is not None else HeadEnded(self._ended)
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(self, *raised: Any) -> None:
        """Park, switch the torque off, and wait until that is done.

        Raises:
            HeadEnded: a fault has ended the head, and the block raised no exception itself.
            KeyboardInterrupt: Ctrl-C was pressed in the meantime.
            SystemExit: SIGTERM or SIGHUP arrived in the meantime.
        """
        by_signal = self._close()
        if raised[1] is not None:
            return
        if by_signal is not None:
            raise by_signal
        if self._ended.startswith("fault"):
            raise HeadEnded(f"the head has ended: {self._ended}") from self._failure

    def end(self, reason: str) -> None:
        """Ask the head to park, from any thread or a signal handler; a second call skips parking.

        Args:
            reason: text for the line that reports the end.
        """
        if self.closing and reason in signal.Signals.__members__:
            self._ended_by = reason
        self._interrupts.request(reason)

    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        super()._pause(lambda: until() or not self._active_run(), seconds)

    def _run(self, run: Run) -> None:
        """Run from torque on to torque off; the target of the loop's thread."""
        ended = "fault: unexpected error"
        lines = WorkQueue("the program's say")  # which may block
        try:
            session = Session(
                run,
                self._interrupts,
                lambda line: lines.add(partial(self._say, line)),
                watch=self._update,
            )
            ended = str(session.run()["stopped_by"])
        except BaseException as error:
            self._failure = error
            ended = f"fault: {error}"
        finally:
            lines.wait_idle(_LINES_S)
            self._ended = ended
            self._finished.set()
            # Otherwise a worker that does not look at the head would keep the program from ending.
            if not self.closing and is_left_waiting_for(self._owner):
                interrupt(self._owner)

    def _update(self, tick: Tick) -> None:
        self._feed.update(tick)
        self._started.set()

    def _abandonment_reason(self) -> str | None:
        """Return why the block cannot end the head any more, None if it can."""
        if not threading.main_thread().is_alive() or is_left_waiting_for(self._owner):
            return "the end of the program"
        return None if self._owner.is_alive() else "the end of the thread that opened it"

    def _close(self) -> BaseException | None:
        """End the loop and wait for it; return the exception that a signal requested meanwhile."""
        if os.getpid() != self._pid:  # a fork has no loop; the head is its parent's
            return None
        self.closing = True
        if not self._interrupts.requests:  # a second request would skip parking
            self._interrupts.request(_ENDED)
        raised: BaseException | None = None
        # Not Thread.join: when a signal interrupts it, CPython up to 3.12 considers the thread
        # ended, and the interpreter exits while the head parks.
        while self._thread.ident is not None and not self._finished.is_set():
            try:
                self._finished.wait()
            except BaseException as error:  # from a signal handler of the program
                raised = error
                self._interrupts.request(_ENDED)
        with contextlib.suppress(BaseException):
            self._thread.join()  # only its last line is left to run
        SIGNALS.remove(self)
        if self._ended_by == "SIGINT":
            return KeyboardInterrupt()
        if self._ended_by:
            return SystemExit(128 + signal.Signals[self._ended_by])
        return raised


class SimulatedHead(LocalHead):
    """A head on emulated servos in simulated time, which passes only when it is stepped.

    The same steps and orders always put the same bytes on the bus. Waiting for an order and
    iterating over states step the head.
    """

    def __enter__(self) -> Self:
        """Switch the torque on at the present joint angles; time passes only in ``step``."""
        run = self._make_run()
        stack = contextlib.ExitStack()
        with stack:
            self._session = Session(
                run,
                Interrupts(signals=False),
                self._say,
                watch=self._feed.update,
            )
            self._loop: TickLoop = stack.enter_context(self._session.power_on())
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *raised: Any) -> None:
        """Park and switch off, in simulated time."""
        fault = self._ended
        self._session.stopped_by = self._ended = fault or _ENDED
        # An error of the program's own block is not a fault of the head.
        self._stack.close()
        if fault and raised[1] is None:
            raise HeadEnded(f"the head has ended: {fault}")

    @property
    def time_s(self) -> float:
        """Return the simulated time."""
        return self._active_run().clock.now_s()

    def step(self, seconds: float | None = None) -> None:
        """Advance simulated time.

        Args:
            seconds: rounded to whole ticks; None: one tick.

        Raises:
            HeadEnded: a fault has ended the head.
        """
        rate_hz = self._active_run().loop.rate_hz
        ticks = 1 if seconds is None else round(seconds * rate_hz)
        for _ in range(ticks):
            self._tick()

    def run_until(self, condition: Callable[[HeadState], Any], timeout_s: float = 60.0) -> bool:
        """Step until a condition is true; return whether it is.

        Args:
            condition: is called with the state after each tick.
            timeout_s: simulated seconds after which the method stops.

        Raises:
            HeadEnded: a fault has ended the head.
        """
        self._tick()
        self._pause(lambda: condition(self.state), timeout_s)
        return bool(condition(self.state))

    def _say_stream(
        self, pieces: Iterable[bytes], rate_hz: int, channels: int, volume: float
    ) -> Order:
        """Say the whole stream; its pieces are read first, as time does not pass meanwhile."""
        with _raising_refused():
            speech = self._active_run().voice.prepare_stream(
                tuple(pieces), rate_hz, channels, self._who
            )
        return self._send(speech)

    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        end_s = self.time_s + seconds - 1e-9
        while not until() and self.time_s < end_s:
            self._tick()

    def _tick(self) -> None:
        self._active_run()
        ended = self._loop.step()
        if ended is not None:
            self._ended = ended
            raise HeadEnded(f"the head has ended: {ended}")


@contextlib.contextmanager
def _raising_refused() -> Any:
    """Raise ``Refused`` when the head refuses a request."""
    try:
        yield
    except (ConfigError, SetupError, ValueError, OSError) as error:
        raise Refused(str(error)) from None
