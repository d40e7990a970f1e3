"""A chain of LX-16A servos on one half-duplex line; implements gazerig's ServoBus."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf, nan
from typing import Annotated

from gazerig.drivers.bus.plausibility import Plausibility
from gazerig.drivers.bus.port_bus import CUT, PortBus
from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.bus.servo_models import ServoModelInfo
from gazerig.drivers.errors import BusLost, ServoMissing
from gazerig.drivers.event_log import EventLog
from gazerig.drivers.serial.port import BusPort, open_port
from gazerig.drivers.types import Feedback, ServoConfig
from gazerig.params import Bounds, Choices
from gazerig_lx16a import protocol as p

STEPS_PER_TURN = 1500.0  # 1000 steps are 240 deg
FASTEST_STEPS_S = 1562.0  # 0.16 s for 60 deg at 7.4 V
MODEL = ServoModelInfo(
    "lx16a", STEPS_PER_TURN, 0, 1000, middle=500, hottest_c=85.0, lowest_v=4.5, highest_v=8.4
)
TRIES, SILENT_S, AGAIN_S, ENTRY_STEPS_S = 3, 0.3, 0.2, 125.0

_Told = tuple[float, float, float, bool, bool]
"""Position, speed, time, torque, and whether it was taken hold of anew."""


@dataclass(frozen=True)
class Lx16aParams:
    """Settings of LX-16A servos."""

    baud: Annotated[int, Choices(p.BAUD), "the only speed of these servos"] = p.BAUD
    reply_timeout_ms: Annotated[float, Bounds(1, 500), "longest wait for a servo's answer"] = 5.0
    give_up_s: Annotated[float, Bounds(0.5, 3600), "the run ends after so long a silence"] = 60.0


class Line:
    """Requests and answers; counts bytes and errors."""

    def __init__(self, port: BusPort, timeout_s: float) -> None:
        self.port, self.timeout_s = port, timeout_s
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()

    def send(self, data: bytes) -> None:
        """Send frames that nobody answers."""
        self.port.write(data)
        self.tx_bytes += len(data)

    def ask(self, servo_id: int, command: int) -> int | None:
        """Return the first parameter of a servo's answer, None where none came."""
        shape, wait_s = p.ANSWERS[command], 10.0 * 20 / p.BAUD + self.timeout_s
        self.port.drain(0.0)
        self.send(p.frame(servo_id, command))
        data, deadline_s = b"", self.port.now_s() + wait_s
        while len(data) < 256:  # more is noise
            wanted = max(1, 6 + shape.size - len(data))
            new = self.port.read_until(wanted, deadline_s)
            data, self.rx_bytes = data + new, self.rx_bytes + len(new)
            for who, said, params, _ in p.frames(data)[0]:  # on some adapters our own comes first
                if (who, said, len(params)) == (servo_id, command, shape.size):
                    return int(shape.unpack(params)[0])
            if len(new) < wanted:
                break
        self.errors["corrupt" if data else "timeout"] += 1
        return None


class Lx16aBus(PortBus):
    """The servos; ``engaged`` while they follow goals."""

    _line: Line

    def __init__(self, port: BusPort, setups: Sequence[ServoConfig], params: Lx16aParams) -> None:
        self._port, self._params = port, params
        self._baud, self._give_up_s = p.BAUD, params.give_up_s
        self._line, self._log = Line(port, params.reply_timeout_ms / 1e3), EventLog()
        self.engaged = False
        self._setups = self._target_setups = tuple(setups)
        self._labels = {setup.id: setup.label() for setup in setups}
        self._check_setups(setups)
        self._reset()

    def _reset(self) -> None:
        count = len(self._setups)
        self._is_down = self._release_due = False
        self._sure = Plausibility([FASTEST_STEPS_S] * count)
        self._heard_s, self._due_s = [self._port.now_s()] * count, [-inf] * count
        self._last: list[tuple[int, float] | None] = [None] * count
        self._check = [False] * count  # the servo must be held where it is before it gets a goal
        self._told = [False] * count
        self._warm: list[float | None] = [None] * count
        self._volts: list[float | None] = [None] * count
        self._turn = 0

    def _stop_supervision(self) -> None:
        self.engaged = False

    def open(self) -> None:
        self._setups = self._target_setups
        open_port(self._port, p.BAUD)
        self._reset()
        try:
            for setup in self._setups:
                self._find(setup)
        except (ServoMissing, BusLost):
            self._port.closePort()
            raise
        self._opened = True

    def _find(self, setup: ServoConfig) -> None:
        where = f"{self._port.port_name}: {setup.label()}"
        mode = self._insist(setup.id, p.MODE)
        if mode is None:
            raise ServoMissing(f"{where} does not answer: check its id, cable and supply")
        if mode:
            raise ServoMissing(f"{where} runs as a motor: set it to servo mode (command 29)")

    def _insist(self, servo_id: int, command: int) -> int | None:
        answers = (self._line.ask(servo_id, command) for _ in range(TRIES))
        return next((answer for answer in answers if answer is not None), None)

    def read(self, now_s: float) -> Feedback:
        count = len(self._setups)
        if not self._reopen_if_needed(now_s):
            return Feedback.create_missing(count)
        try:
            told = [self._read_one(i, now_s) for i in range(count)]
            self._read_in_turn(told)
        except BusLost as lost:
            self._record_loss(lost)
            return Feedback.create_missing(count)
        silent_s = now_s - max(self._heard_s)
        if silent_s >= self._give_up_s:
            raise BusLost(
                f"{self._port.port_name}: no servo has answered for {silent_s:.1f} s: "
                "check supply and cable"
            )
        none: _Told = (nan, nan, -inf, False, False)
        columns = list(zip(*[one or none for one in told], strict=True))
        return Feedback(
            columns[0], columns[1], tuple([nan if one is None else 0.0 for one in told]),
            columns[2], tuple(self._warm), tuple(self._volts), columns[3], ("",) * count,
            (True,) * count, columns[4], tuple([i for i, one in enumerate(told) if one is None]),
        )  # fmt: skip

    def _read_one(self, i: int, now_s: float) -> _Told | None:
        """Return what one servo tells, None where it is silent."""
        if now_s < self._due_s[i]:
            return None
        setup, line = self._setups[i], self._line
        steps = line.ask(setup.id, p.POSITION)
        loaded = None if steps is None else line.ask(setup.id, p.LOADED)
        at_s, label = self._port.now_s(), setup.label()
        if steps is None or loaded is None or not self._sure.is_plausible(i, steps, at_s):
            silent_s = now_s - self._heard_s[i]
            self._due_s[i] = now_s + AGAIN_S if silent_s > SILENT_S else -inf
            if silent_s > SILENT_S and not self._told[i]:
                self._told[i] = True
                self._log.add(f"{label} does not answer: check its cable")
            return None
        if self._told[i]:
            self._log.add(f"{label} answers again")
        self._heard_s[i], self._told[i] = at_s, False
        anew = self.engaged and (self._check[i] or not loaded)
        if anew and not self._hold(setup, steps):
            self._check[i] = True
            return None
        if anew and not loaded:
            self._log.add(f"{label} restarted: set up again")
        self._check[i] = False
        last, self._last[i] = self._last[i], (steps, at_s)
        speed = (steps - last[0]) / (at_s - last[1]) if last and at_s > last[1] else 0.0
        return float(steps), speed, at_s, bool(loaded) or anew, anew

    def _read_in_turn(self, told: Sequence[object]) -> None:
        """Read one temperature or voltage."""
        self._turn += 1
        i, quantity = self._turn // 2 % len(told), self._turn % 2
        if told[i] is None:
            return
        answer = self._line.ask(self._setups[i].id, (p.TEMPERATURE, p.VOLTAGE)[quantity])
        if answer is not None and quantity:
            self._volts[i] = answer / 1e3
        elif answer is not None:
            self._warm[i] = float(answer)

    def _hold(self, setup: ServoConfig, steps: int) -> bool:
        """Make a servo hold where it is, or move into its limits slowly; confirmed."""
        goal = min(max(steps, setup.min_steps), setup.max_steps)
        for _ in range(TRIES):
            self._line.send(_move(setup.id, goal, abs(goal - steps) / _speed(setup, steps)))
            self._line.send(p.frame(setup.id, p.LOAD, b"\x01"))
            if self._line.ask(setup.id, p.LOADED):
                return True
        return False

    def enable_torque(self) -> tuple[int, ...]:
        self._setups, goals = self._target_setups, []
        try:
            for setup in self._setups:
                steps = self._insist(setup.id, p.POSITION)
                if steps is None or not self._hold(setup, steps):
                    self.disable_torque()
                    raise ServoMissing(f"{setup.label()} does not confirm its torque: {CUT}")
                goals.append(min(max(steps, setup.min_steps), setup.max_steps))
        except BusLost:
            self._release_due = True
            raise
        self.engaged, self._release_due = True, False
        return tuple(goals)

    def write(self, goals_steps: Sequence[int]) -> None:
        if len(goals_steps) != len(self._setups):
            raise ValueError(f"{len(goals_steps)} goals for {len(self._setups)} servos")
        if any(goal != goal for goal in goals_steps):
            raise ValueError("a goal is not a number: every goal must be a whole number of steps")
        if not self.engaged or self._is_down:
            return
        out = b""
        for i, (goal, setup) in enumerate(zip(goals_steps, self._setups, strict=True)):
            last, inside = self._last[i], round(min(max(goal, setup.min_steps), setup.max_steps))
            # One that is silent may have restarted, and would go there at its own speed.
            fresh = last is not None and last[1] == self._heard_s[i] > self._now_s - SILENT_S
            if last is not None and fresh and not self._check[i]:
                out += _move(setup.id, inside, abs(inside - last[0]) / _speed(setup, last[0]))
        try:
            self._line.send(out)
        except BusLost as lost:
            self._record_loss(lost)

    def faults(self) -> tuple[str, ...]:
        return ()  # these servos show errors by their lamp alone

    def _check_setups(self, setups: Sequence[ServoConfig]) -> None:
        for setup in setups:
            if not 0 <= setup.min_steps < setup.max_steps <= 1000:
                raise ValueError(f"{setup.label()}: its range must lie in 0..1000 steps")

    def _reset_after_reconnect(self) -> None:
        self._check = [True] * len(self._setups)
        self._sure.forget()

    def _switch_off(self) -> ReleaseResult:
        return release_all(self._line, [setup.id for setup in self._setups])


def _speed(setup: ServoConfig, steps: float) -> float:
    """Return the speed of a servo: slow until it is within its limits."""
    if setup.min_steps <= steps <= setup.max_steps:
        return setup.max_speed_steps_s
    return min(setup.entry_speed_steps_s or ENTRY_STEPS_S, setup.max_speed_steps_s)


def _move(servo_id: int, steps: int, seconds: float) -> bytes:
    return p.frame(
        servo_id, p.MOVE, steps.to_bytes(2, "little") + _ms(seconds).to_bytes(2, "little")
    )


def _ms(seconds: float) -> int:
    return min(30_000, ceil(1e3 * seconds))


def release_all(line: Line, ids: Sequence[int]) -> ReleaseResult:
    """Switch torque off, and tell which servos keep it or do not answer."""
    left = dict.fromkeys(ids)
    for _ in range(TRIES):
        line.send(b"".join(p.frame(servo_id, p.LOAD, b"\x00") for servo_id in left))
        left = {i: loaded for i in left if (loaded := line.ask(i, p.LOADED)) != 0}
    unconfirmed = tuple(i for i, loaded in left.items() if loaded is None)
    return ReleaseResult(tuple(i for i in left if i not in unconfirmed), unconfirmed)


def release(port: BusPort, params: Lx16aParams, ids: tuple[int, ...]) -> tuple[int, ...]:
    """Switch torque off for the guardian; return the ids that did not confirm."""
    open_port(port, p.BAUD)
    result = release_all(Line(port, params.reply_timeout_ms / 1e3), ids)
    return (*result.holding_ids, *result.unconfirmed_ids)
