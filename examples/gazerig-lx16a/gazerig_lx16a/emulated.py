"""Emulated LX-16A servos: real frames in, real frames out.

What the documents leave open is taken to be the worse case: a move switches the torque on.
"""

from collections.abc import Callable, Mapping

from gazerig.drivers.plugins import EmulatedJoint
from gazerig.sim_mock.faults.grammar import CommandTable, Verb
from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.faults.verbs import ADAPTER_VERBS, CLOSING_VERBS, LINE_VERBS, loss_verb
from gazerig.sim_mock.replies import Piece
from gazerig_lx16a import protocol as p
from gazerig_lx16a.bus import FASTEST_STEPS_S, Lx16aParams


class EmulatedLx16a:
    """One servo: it goes to its target in a straight line, within the time it was given."""

    def __init__(self, servo_id: int, steps: float, low: float, high: float) -> None:
        self.id, self.place, self._low, self._high = servo_id, steps, low, high
        self.target, self._speed, self.torque, self._at_s = steps, 0.0, False, 0.0

    def advance(self, now_s: float) -> None:
        """Let time pass until now."""
        dt_s, self._at_s = now_s - self._at_s, now_s
        if self.torque:
            most = min(self._speed, FASTEST_STEPS_S) * max(0.0, dt_s)
            way = min(max(self.target - self.place, -most), most)
            self.place = min(max(self.place + way, self._low), self._high)

    def restart(self) -> None:
        """Lose torque and target, as after a dip of the supply."""
        self.torque, self.target = False, self.place

    def answer(self, command: int, params: bytes) -> bytes | None:
        """Carry out a command; return the parameters of the answer, None for silence."""
        if command == p.MOVE and len(params) == 4:
            self.target = float(min(1000, int.from_bytes(params[:2], "little")))
            seconds = int.from_bytes(params[2:], "little") / 1e3
            way = abs(self.target - self.place)
            self._speed, self.torque = (way / seconds if seconds else FASTEST_STEPS_S), True
        elif command == p.LOAD and len(params) == 1:
            self.torque = bool(params[0])
        elif command in p.ANSWERS and not params:
            values = {p.POSITION: (round(self.place),), p.LOADED: (int(self.torque),),
                      p.TEMPERATURE: (31,), p.VOLTAGE: (7400,), p.MODE: (0, 0, 0)}  # fmt: skip
            return p.ANSWERS[command].pack(*values[command])
        return None


class Lx16aChain:
    """The device at the end of the line; what can befall a line is gazerig's."""

    def __init__(
        self, servos: list[EmulatedLx16a], now_s: Callable[[], float], seed: int = 0
    ) -> None:
        self.servos, self.now_s = {servo.id: servo for servo in servos}, now_s
        self.faults = ChainFaults(self, COMMANDS, seed)
        self._rest = b""
        for servo in servos:
            servo.advance(now_s())

    def find_servo(self, servo_id: int) -> EmulatedLx16a:
        """Return a servo, brought up to now."""
        servo = self.servos[servo_id]
        servo.advance(self.now_s())
        return servo

    def positions_steps(self) -> tuple[float, ...]:
        return tuple(self.find_servo(servo_id).place for servo_id in self.servos)

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Piece]:
        """Carry out the commands in these bytes; return their answers."""
        before, whole_data, faults = len(self._rest), self._rest + data, self.faults
        found, rest = p.frames(whole_data)
        self._rest, answers = whole_data[rest:], []
        for servo_id, command, params, end in found:
            if command == p.MOVE and faults.use_fault("lose_writes"):
                continue
            for one in self.servos if servo_id == p.BROADCAST else {servo_id} & set(self.servos):
                said = self.find_servo(one).answer(command, params)
                if said is None or servo_id == p.BROADCAST:
                    continue
                if not faults.use_fault("lose", one):
                    answers.append(Piece(one, p.frame(one, command, said), max(0, end - before)))
        return answers


class ChainFaults(LineFaults):
    """What befalls the line, and the servos themselves."""

    def reports(self) -> list[dict[str, object]]:
        chain: Lx16aChain = self.chain
        servos = [chain.find_servo(servo_id) for servo_id in chain.servos]
        return [
            {"id": s.id, "position": s.place, "goal": round(s.target), "torque": s.torque}
            for s in servos
        ]


def _restart(faults: ChainFaults, servo_id: int) -> str:
    faults.chain.find_servo(servo_id).restart()
    return f"servo {servo_id} restarts"


COMMANDS = CommandTable(
    {**LINE_VERBS, **ADAPTER_VERBS, "brown-out": Verb(_restart, "ID"),
     "lose-writes": loss_verb("lose_writes", "moves"), **CLOSING_VERBS}, 253,
)  # fmt: skip


def chain_of(starts: Mapping[int, float], now_s: Callable[[], float]) -> Lx16aChain:
    """Return servos that stand at these steps, by their ids."""
    return Lx16aChain([EmulatedLx16a(i, x, 0.0, 1000.0) for i, x in starts.items()], now_s)


def device(
    params: Lx16aParams, joints: tuple[EmulatedJoint, ...], now_s: Callable[[], float], seed: int
) -> Lx16aChain:
    """Return the servos of a rig, for ``--mock``."""
    servos = [
        EmulatedLx16a(j.id, j.start_steps, j.stop_low_steps, j.stop_high_steps) for j in joints
    ]
    return Lx16aChain(servos, now_s, seed)
