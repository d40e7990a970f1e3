"""Program side of the guardian: starts the process and wraps the buses that it guards."""

import base64
import os
import pickle
import select
import subprocess
from collections.abc import Sequence
from math import inf

from gazerig.drivers.bus.goal_limits import far_outside_steps
from gazerig.drivers.errors import DriverError, ServoFault, ServoMissing, SetupError
from gazerig.drivers.process import child_process
from gazerig.drivers.types import BusHealth, Feedback, ServoBus, ServoConfig
from gazerig.robot.guardian.heartbeat import (
    IDLE,
    RELEASED,
    RELEASING,
    Heartbeat,
    shared_file,
)
from gazerig.robot.guardian.release_plan import ReleasePlan
from gazerig.robot.model.clock import RealClock

RETRY_S = 1.0
"""Time between attempts to switch the torque of servos on again, s."""

_READINGS = 3
"""Attempts to read every position before the torque is switched on again."""

_MODULE = "gazerig.robot.guardian.process"

READY_S = 20.0
"""Timeout of a guardian's start, s; it takes 0.1 s, on a machine under load much longer."""

GOODBYE_S = 2.0
CHECK_S = 0.25
"""Time between two checks of the guardian, s."""

RESTART_S = 5.0
"""Time between two starts of a guardian that keeps ending, s."""

HUNG_S = 2.0
"""A guardian that has not read the heartbeat for this time hangs; it reads 50 times a second."""

LONGEST_CALL_S = 10.0
"""Longest time that the traffic of one call of a bus counts as heartbeats, s.

To prepare many servos on a noisy line takes seconds. A bus that asks for ever hangs.
"""


class Guardian:
    """Guardian process of all ports of a rig.

    Args:
        plans: Servos to release, one plan for each port.
    """

    def __init__(self, plans: tuple[ReleasePlan, ...]) -> None:
        self.plans = plans
        self._fd = shared_file()
        self._heartbeat = Heartbeat(self._fd)
        self._process: subprocess.Popen[bytes] | None = None
        self._ready = False
        self._users: set[int] = set()
        self._check_s = self._restart_s = 0.0
        self._looks = (0, inf)
        self._events: list[str] = []
        self._clock = RealClock()
        self._beat_s = inf

    def __del__(self) -> None:
        os.close(self._fd)

    def beat(self) -> None:
        """Count one heartbeat; only the control loop's thread may call it."""
        self._beat_s = self._clock.now_s()
        self._heartbeat.beat()

    def beat_on_traffic(self) -> None:
        """Count one heartbeat for traffic, unless the last other one is too long ago."""
        if self._clock.now_s() < self._beat_s + LONGEST_CALL_S:
            self._heartbeat.beat()

    def join(self, plan: int) -> None:
        """Register one port and start the guardian if it is not running, without waiting for it.

        Raises:
            SetupError: no process can be started.
        """
        self._users.add(plan)
        if self._process is None:
            try:
                self._start()
            except OSError as error:
                raise SetupError(f"no guardian can be started: {error.strerror}") from error

    def wait_until_ready(self) -> None:
        """Wait until a newly started guardian is ready.

        Raises:
            SetupError: the guardian does not start.
        """
        if self._process is not None and self._process.stdout is not None and not self._ready:
            stdout = self._process.stdout
            if select.select([stdout], [], [], READY_S)[0]:
                self._ready = bool(os.read(stdout.fileno(), 1))
        if not self._ready:
            raise SetupError(
                "the guardian, which releases the servos if this program dies, did not start: "
                "see the lines above"
            )

    def arm(self, plan: int) -> None:
        """Start to guard one port; must be called before its torque is switched on.

        Raises:
            SetupError: the guardian does not run; torque must not be switched on without it.
        """
        self.wait_until_ready()
        self._heartbeat.set_state(plan, IDLE)
        self.beat()
        self._heartbeat.arm(plan, True)

    def disarm(self, plan: int) -> None:
        """Report to the guardian that a port's torque is off."""
        self._heartbeat.arm(plan, False)

    def state(self, plan: int) -> int:
        """Return whether the guardian has left a plan's servos alone, releases or released them."""
        return self._heartbeat.state(plan)

    def acknowledge(self, plan: int) -> None:
        """Record that the loop has noticed the release; the guardian may release again."""
        self._heartbeat.set_state(plan, IDLE)

    def check(self, now_s: float) -> None:
        """Check the guardian four times a second; replace it if it has ended or hangs.

        Args:
            now_s: Time, monotonic seconds.
        """
        if now_s < self._check_s or self._process is None:
            return
        self._check_s = now_s + CHECK_S
        code = self._process.poll()
        if self._heartbeat.checks != self._looks[0]:
            self._looks = self._heartbeat.checks, now_s
        # A guardian that is still starting has not read yet: its last time is infinity.
        late = now_s - self._looks[1] > HUNG_S
        hangs = code is None and (late or child_process.is_suspended(self._process.pid))
        if code is None and not hangs or now_s < self._restart_s:
            return
        self._restart_s = now_s + RESTART_S
        if hangs:
            self._process.kill()
            self._process.wait()
        self._close_pipes(self._process)
        for i in range(len(self.plans)):
            if self.state(i) == RELEASING:  # the dead guardian cannot complete the release
                self._heartbeat.set_state(i, RELEASED)
        why = "did not respond" if hangs else f"ended unexpectedly (exit code {code})"
        self._events.append(f"the guardian {why}: started again")
        try:
            self._start()
        except OSError as error:
            self._events.append(f"no guardian: {error.strerror}; tried again in {RESTART_S:g} s")

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events, self._events = tuple(self._events), []
        return events

    def leave(self, plan: int) -> None:
        """Unregister one port; after the last the guardian ends.

        If servos could not be released and are still armed, the guardian retries for some
        seconds.
        """
        self._users.discard(plan)
        if self._users or self._process is None:
            return
        ending, self._process = self._process, None
        self._close_pipes(ending)
        if any(self._heartbeat.is_armed(i) for i in range(len(self.plans))):
            return
        try:
            ending.wait(GOODBYE_S)
        except subprocess.TimeoutExpired:  # nothing is armed: it has no more tasks
            ending.kill()
            ending.wait()

    @staticmethod
    def _close_pipes(process: "subprocess.Popen[bytes]") -> None:
        for pipe in (process.stdin, process.stdout):
            if pipe is not None:
                pipe.close()

    def _start(self) -> None:
        self._ready = False
        self._looks = self._heartbeat.checks, inf
        self._process = child_process.start(
            _MODULE,
            str(self._fd),
            base64.b85encode(pickle.dumps(self.plans)).decode(),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            bufsize=0,
            pass_fds=(self._fd,),
        )


class GuardedBus:
    """Servo bus with heartbeats and a guardian; implements ``ServoBus``.

    Every read and write counts one heartbeat. When a loop resumes after it hung, the guardian has
    switched the torque off. The bus then switches it off again with confirmation and on at the
    present positions, as after a restart of the servos, and marks the answers ``rearmed``.

    Args:
        bus: Bus of the servos.
        setups: Its servos.
        guardian: Guardian of the rig.
        plan: Index of the release plan of this bus's port.
    """

    def __init__(
        self, bus: ServoBus, setups: Sequence[ServoConfig], guardian: Guardian, plan: int
    ) -> None:
        self._bus, self._guardian, self._plan = bus, guardian, plan
        self._beat = guardian.beat
        self._setups = tuple(setups)
        self._silent = Feedback.create_missing(len(self._setups))
        self._holding = self._lost_hold = False
        self._retry_s, self._refusal = 0.0, ""
        self._rearmed: set[int] = set()
        self._events: list[str] = []

    def open(self) -> None:
        """Start the guardian and open the bus; torque stays off.

        Raises:
            SetupError: no guardian can be started, or the bus raises it.
        """
        self._guardian.join(self._plan)
        try:
            self._bus.open()
        except BaseException:
            self._guardian.leave(self._plan)
            raise

    def read(self, now_s: float) -> Feedback:
        """Read all servos; all are missing while the guardian releases them.

        Raises:
            BusLost: no servo has answered for longer than the timeout of the bus.
        """
        self._beat()
        self._guardian.check(now_s)
        state = self._guardian.state(self._plan)
        if self._lost_hold or state != IDLE:
            if state == RELEASING:
                return self._silent
            self._restore_torque(now_s)
        feedback = self._bus.read(now_s)
        if not self._rearmed:
            return feedback
        # Each servo's first answer after torque-on.
        here = self._rearmed.difference(feedback.missing)
        self._rearmed -= here
        rearmed = [reset or i in here for i, reset in enumerate(feedback.rearmed)]
        return feedback._replace(rearmed=tuple(rearmed))

    def enable_torque(self) -> tuple[int, ...]:
        """Arm the guardian and switch torque on at the present positions.

        Raises:
            SetupError: the guardian did not start, or the bus raises it.
            DriverError: the bus raises it.
        """
        # Armed first, because torque is switched on servo by servo.
        self._guardian.arm(self._plan)
        goals = self._bus.enable_torque()
        self._holding, self._lost_hold = True, False
        return goals

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; send nothing after the guardian has released them.

        Raises:
            ValueError: a goal is not a number, or their number is not that of the servos.
        """
        self._beat()
        if self._lost_hold or self._guardian.state(self._plan) != IDLE:
            return
        self._bus.write(goals_steps)

    def disable_torque(self) -> None:
        """Switch torque off on every servo and disarm the guardian.

        Raises:
            BusLost: the port is lost; the guardian retries.
        """
        self._holding = self._lost_hold = False
        self._rearmed.clear()
        self._bus.disable_torque()
        self._guardian.disarm(self._plan)

    def close(self) -> None:
        """Close the port and unregister from the guardian; safe to call twice."""
        try:
            self._bus.close()
        finally:
            self._guardian.leave(self._plan)

    def faults(self) -> tuple[str, ...]:
        """Return the latched servo faults, one line each."""
        return self._bus.faults()

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events = (*self._guardian.events(), *self._events, *self._bus.events())
        self._events.clear()
        return events

    def health(self) -> BusHealth:
        """Return byte and error counts."""
        return self._bus.health()

    def _restore_torque(self, now_s: float) -> None:
        """Switch the torque of released servos on again, as after a restart of the servos."""
        if not self._lost_hold:
            self._guardian.acknowledge(self._plan)
            if not self._holding:
                return
            self._lost_hold, self._retry_s, self._refusal = True, now_s, ""
            self._events.append("the control loop did not run: the guardian switched torque off")
        if now_s < self._retry_s:
            return
        self._retry_s = now_s + RETRY_S
        try:
            # Goals that were being sent when the loop stopped may have arrived after the release.
            self._bus.disable_torque()
            self._refuse_far_outside(now_s)
            self._bus.enable_torque()
        except DriverError as error:
            if str(error) != self._refusal:  # once, not with every attempt
                self._refusal = str(error)
                self._events.append(f"torque could not be switched on again: {error}")
            return
        self._lost_hold = False
        self._rearmed = set(self._silent.missing)
        self._events.append("torque on again at the present angles: continuing slowly")

    def _refuse_far_outside(self, now_s: float) -> None:
        """Refuse torque while a servo is far outside its limits, or its position is unknown.

        Raises:
            ServoMissing: a servo does not answer.
            ServoFault: a servo is far outside its limits.
        """
        for _ in range(_READINGS):
            feedback = self._bus.read(now_s)
            if not feedback.missing:
                break
        rows = zip(self._setups, feedback.measured, feedback.position_steps, strict=True)
        for i, (setup, measured, steps) in enumerate(rows):
            if not measured:
                continue
            if i in feedback.missing:
                raise ServoMissing(f"no position from {setup.label()}: check its cable")
            if text := far_outside_steps(setup, steps):
                raise ServoFault(f"{setup.label()} {text}")
