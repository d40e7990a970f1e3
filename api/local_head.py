"""Heads of this program: one that runs beside it, and one in simulated time."""

import contextlib
import logging
import os
import signal
import threading
from abc import abstractmethod
from collections.abc import Callable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from gazerig.config.faults import ConfigError
from gazerig.errors import Error, HeadEnded, Refused
from gazerig.head import Head
from gazerig.order import Order
from gazerig.program_signals import SIGNALS
from gazerig.robot.app import session
from gazerig.robot.app.assemble import Substitutes
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.control.head_state import HeadEvent, HeadState, head_state
from gazerig.robot.control.interrupts import Interrupts
from gazerig.robot.control.line_queue import LineQueue
from gazerig.robot.control.loop import TickLoop
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_feed import Progress, TickFeed
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.commands import Command, Value

_LOG = logging.getLogger("gazerig")
_POLL_S = 0.004
_ENDED = "the program"


class LocalHead(Head):
    """A head whose control loop is in this program; ``gazerig.open`` makes one.

    Args:
        options: what to run.
        substitutes: the program's own camera, detector or rule of attention.
        say: gets one line about whatever happens; None: ``logging.getLogger("gazerig")``.
    """

    def __init__(
        self,
        options: RunOptions,
        substitutes: Substitutes,
        say: Callable[[str], None] | None = None,
    ) -> None:
        self.rig = options.rig
        self._options, self._substitutes = options, substitutes
        self._say = say if say is not None else _LOG.info
        self._feed = TickFeed()
        self._composed: session.ComposedRun | None = None
        self._ended = ""

    @property
    def state(self) -> HeadState:
        """Return the newest tick of the control loop."""
        tick = self._feed.newest
        if tick is None:
            self._running()
            self._pause(lambda: self._feed.newest is not None, 10.0)
            tick = self._feed.newest
        if tick is None:
            raise HeadEnded("the control loop does not tick")
        return head_state(tick)

    def get(self, prefix: str = "") -> Mapping[str, Value]:
        """Return the values in force of all keys of the rig that begin so."""
        with _as_refused():
            return self._params().get(prefix)

    def set(self, changes: Mapping[str, Value]) -> tuple[str, ...]:
        """Put values at dotted keys in force from the next tick on, all of them or none."""
        with _as_refused():
            return self._params().set(changes)

    def save(self, path: Path | str | None = None) -> Path:
        """Write what is in force into the rig's file, or another one; return the file."""
        whole = None if path is None else Path(path).expanduser().absolute()
        with _as_refused():
            return self._params().save(whole).path

    def revert(self) -> tuple[str, ...]:
        """Put the values of the rig's file in force again; return a line for each."""
        with _as_refused():
            return self._params().revert()

    def menus(self) -> Mapping[str, tuple[str, ...]]:
        """Return behaviours, modes of conversation and what the lids do; those in force first."""
        return self._running().made.robot.menus()

    def _progress(self) -> Progress:
        return self._feed.progress()

    def _events(self, after: int) -> tuple[HeadEvent, ...]:
        return self._feed.events(after)

    def _give(self, command: Command) -> Order:
        robot = self._running().made.robot
        try:
            ticket = robot.command(command)
        except ValueError as error:
            raise Refused(str(error)) from None
        order = Order(self, lambda: ticket.wait(0.0))
        self._feed.follow(order._see)
        return order

    def _running(self) -> session.ComposedRun:
        """Return the run.

        Raises:
            Error: it has not begun.
            HeadEnded: it has ended.
        """
        if self._ended:
            raise HeadEnded(f"the head has ended: {self._ended}")
        if self._composed is None:
            raise Error(f"the head moves inside a block: with gazerig.open({self.rig!r}) as head:")
        return self._composed

    def _params(self) -> ParamStore:
        """Return the parameters of the run; raises as ``_running`` does."""
        tuning = self._running().tuning
        assert tuning is not None, "only a run without a program has none"
        return tuning

    def _compose(self) -> session.ComposedRun:
        if self._composed is not None:
            raise Error("a head is used in one block: open another")
        self._composed = session.compose(self._options, self._substitutes)
        return self._composed

    @abstractmethod
    def __enter__(self) -> Self:
        """Switch the torque on where the joints are, and begin."""


class RunningHead(LocalHead):
    """A head whose loop runs in a thread beside the program, in real time.

    Whatever ends the block parks the head and switches the torque off, as ``gazerig run`` does:
    its end, an exception, Ctrl-C, SIGTERM and SIGHUP (``ProgramSignals``), the end of the thread
    that opened it or of the interpreter. Further signals skip the rest of parking. What ends the
    program at once (SIGKILL, a crash) leaves the torque to the guardian.

    Attributes:
        closing: the block has ended, and waits until the head has parked.
    """

    def __init__(
        self,
        options: RunOptions,
        substitutes: Substitutes,
        say: Callable[[str], None] | None = None,
    ) -> None:
        super().__init__(options, substitutes, say)
        self._interrupts = Interrupts(also=self._abandoned, signals=False)
        self._owner = threading.current_thread()
        self._begun, self._over = threading.Event(), threading.Event()
        self._failure: BaseException | None = None
        self._pid = os.getpid()
        self._clock = RealClock()
        self.closing = False
        self._ended_by = ""

    def __enter__(self) -> Self:
        """Switch the torque on where the joints are, and run; return when the loop ticks."""
        self._owner = threading.current_thread()
        composed = self._compose()
        # Never a daemon, whatever thread opens the head: the interpreter's end waits for parking.
        self._thread = threading.Thread(
            target=self._run, args=(composed,), name=f"head {self.rig}", daemon=False
        )
        SIGNALS.add(self)
        try:
            self._thread.start()
            while not self._begun.wait(0.05) and not self._over.is_set():
                pass
            if not self._begun.is_set():
                raise self._failure if self._failure is not None else HeadEnded(self._ended)
        except BaseException:
            self._close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Park, switch the torque off, and wait until that is done.

        Raises:
            HeadEnded: a fault has ended the head before, and the block did not fail by itself.
            KeyboardInterrupt: Ctrl-C came meanwhile.
            SystemExit: SIGTERM or SIGHUP came meanwhile.
        """
        raised = self._close()
        if error is not None:
            return
        if raised is not None:
            raise raised
        if self._failure is not None:
            raise HeadEnded(f"the head has ended: {self._ended}") from self._failure
        if self._ended.startswith("fault"):
            raise HeadEnded(f"the head has ended: {self._ended}")

    def end(self, reason: str) -> None:
        """Ask the head to park, from any thread or a signal handler; again, to park no further.

        Args:
            reason: for the line that reports the end.
        """
        if self.closing and reason in signal.Signals.__members__:
            self._ended_by = reason
        self._interrupts.request(reason)

    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        end_s = self._clock.now_s() + seconds
        while not until():
            self._running()
            now_s = self._clock.now_s()
            if now_s >= end_s:
                return
            self._clock.sleep_until(min(now_s + _POLL_S, end_s))

    def _run(self, composed: session.ComposedRun) -> None:
        """Run from torque on to torque off; the thread of the loop."""
        ended = "fault: unexpected error"
        try:
            name = "the logger gazerig" if self._say == _LOG.info else "say of the program"
            with LineQueue(self._say, name) as said:
                figures = session.run(
                    composed, self._interrupts, said.line, watch=self._update, summarised=False
                )
            ended = str(figures["stopped_by"])
        except BaseException as error:
            self._failure = error
            ended = f"fault: {error}"
        finally:
            self._ended = ended
            self._over.set()

    def _update(self, tick: Tick) -> None:
        self._feed.update(tick)
        if not self._begun.is_set():
            self._begun.set()

    def _abandoned(self) -> str | None:
        """Return why nobody is left to end the block."""
        if not threading.main_thread().is_alive():
            return "the end of the program"
        return None if self._owner.is_alive() else "the end of the thread that opened it"

    def _close(self) -> BaseException | None:
        """End the loop and wait for it; return what a signal asked for meanwhile."""
        if os.getpid() != self._pid:  # a fork has no loop, and the head is its parent's
            return None
        self.closing = True
        if not self._interrupts.requests:  # one more would skip parking
            self._interrupts.request(_ENDED)
        raised: BaseException | None = None
        # Not by the thread's join: when a signal interrupts it, CPython up to 3.12 takes the thread
        # for ended, and the interpreter ends while the head parks.
        while self._thread.ident is not None and not self._over.is_set():
            try:
                self._over.wait()
            except BaseException as error:  # of a signal handler of the program's own
                raised = error
                self._interrupts.request(_ENDED)
        with contextlib.suppress(BaseException):
            self._thread.join()  # it has no more than its last line to do
        SIGNALS.remove(self)
        if self._ended_by == "SIGINT":
            return KeyboardInterrupt()
        if self._ended_by:
            return SystemExit(128 + signal.Signals[self._ended_by])
        return raised


class SimulatedHead(LocalHead):
    """A head on emulated servos in simulated time, which passes only when it is stepped.

    The same steps and orders give the same bytes on the bus, every time. Waiting for an order
    and iterating over states step the head.
    """

    def __enter__(self) -> Self:
        """Switch the torque on where the joints are; time stands still until ``step``."""
        composed = self._compose()
        stack = contextlib.ExitStack()
        with stack:
            stack.callback(composed.made.close)
            self._session = session.Session(
                composed,
                Interrupts(signals=False),
                self._say,
                watch=self._feed.update,
                summarised=False,
            )
            self._loop: TickLoop = stack.enter_context(self._session.powered())
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Park and switch off, in simulated time."""
        fault = self._ended
        self._session.stopped_by = self._ended = fault or _ENDED
        # What fails in the program's own block is no fault of the head.
        self._stack.close()
        if fault and error is None:
            raise HeadEnded(f"the head has ended: {fault}")

    @property
    def time_s(self) -> float:
        """Return the simulated time."""
        return self._running().made.clock.now_s()

    def step(self, seconds: float | None = None) -> None:
        """Let simulated time pass.

        Args:
            seconds: rounded to whole ticks; None: one tick.

        Raises:
            HeadEnded: a fault has ended the head.
        """
        made = self._running().made
        ticks = 1 if seconds is None else round(seconds * made.loop.rate_hz)
        for _ in range(ticks):
            self._tick()

    def run_until(self, condition: Callable[[HeadState], Any], timeout_s: float = 60.0) -> bool:
        """Step until a condition holds; return whether it came to pass.

        Args:
            condition: gets the state after each tick.
            timeout_s: simulated seconds after which it is given up.

        Raises:
            HeadEnded: a fault has ended the head.
        """
        end_s = self.time_s + timeout_s - 1e-9
        while self.time_s < end_s:
            self._tick()
            if condition(self.state):
                return True
        return False

    def _pause(self, until: Callable[[], bool], seconds: float) -> None:
        end_s = self.time_s + seconds - 1e-9
        while not until() and self.time_s < end_s:
            self._tick()

    def _tick(self) -> None:
        self._running()
        ended = self._loop.step()
        if ended is not None:
            self._ended = ended
            raise HeadEnded(f"the head has ended: {ended}")


@contextlib.contextmanager
def _as_refused() -> Any:
    """Raise what parameters refuse as this interface does."""
    try:
        yield
    except (ConfigError, ValueError, OSError) as error:
        raise Refused(str(error)) from None
