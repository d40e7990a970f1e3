"""What can go wrong with emulated STS servos, beside all that can on their line."""

from sim_mock.faults.grammar import Commands
from sim_mock.faults.servo import Chain, JointFaults
from sim_mock.feetech.packets import HEADER
from sim_mock.feetech.servo import FeetechServo

TOO_HOT_C = 5.0
"""An overheated motor is so much above its limit."""


class StsFaults(JointFaults[FeetechServo]):
    """The faults of one chain."""

    def __init__(self, chain: Chain[FeetechServo], commands: Commands, seed: int = 0) -> None:
        super().__init__(chain, commands, seed, HEADER)

    def overload(self, servo_id: int) -> str:
        """Let a servo's overload protection act."""
        self._bus.here(servo_id).trip()
        return f"servo {servo_id} protects itself: overload"

    def overheat(self, servo_id: int) -> str:
        """Let a servo's motor be too hot; it cools by itself."""
        servo = self._bus.here(servo_id)
        return self.temperature(servo_id, servo.memory.get("temperature_limit") + TOO_HOT_C)

    def encoder(self, servo_id: int) -> str:
        """Let a servo find its angle sensor broken."""
        self._bus.here(servo_id).lose_angle()
        return f"servo {servo_id} finds its angle sensor broken"

    def brown_out(self, servo_id: int) -> str:
        """Let a servo restart as a dip of the supply makes it: no status tells."""
        self._bus.here(servo_id).restart()
        return f"servo {servo_id} restarts"

    def reset(self, servo_id: int) -> str:
        """Let a servo be as from the factory: id 1, 1000000 bit/s."""
        self._bus.here(servo_id).factory_reset(1)
        return f"servo {servo_id} is as from the factory: id 1, 1000000 bit/s"

    def reports(self) -> list[dict[str, object]]:
        """Give the state of every servo, for ``status``."""
        return [_report(self._bus.here(servo_id)) for servo_id in self._bus.ids()]


def _report(servo: FeetechServo) -> dict[str, object]:
    return {
        "id": servo.id,
        "model": servo.model.name,
        "position": round(servo.position_steps),
        "goal": servo.memory.get("goal_position"),
        "torque": int(servo.torque),
        "error": servo.error,
        "temperature_c": round(servo.temperature_c),
        "voltage_01v": servo.read(62, 1)[0],
    }
