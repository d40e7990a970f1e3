"""What can go wrong with emulated Dynamixel servos, beside all that can on their line."""

from sim_mock.dynamixel.servo import DynamixelServo
from sim_mock.faults.servo import JointFaults

_REPORTED = {
    "position": ("present_position", 132, 4),
    "goal": ("goal_position", 116, 4),
    "torque": ("torque_enable", 64, 1),
    "error": ("hardware_error_status", 70, 1),
    "temperature_c": ("present_temperature", 146, 1),
    "voltage_01v": ("present_input_voltage", 144, 2),
}


class Faults(JointFaults[DynamixelServo]):
    """The faults of one chain."""

    def overload(self, servo_id: int) -> str:
        """Let a servo's overload protection trip."""
        return self._fail(servo_id, "overload")

    def overheat(self, servo_id: int) -> str:
        """Let a servo's overheating protection trip."""
        return self._fail(servo_id, "overheating")

    def encoder(self, servo_id: int) -> str:
        """Let a servo find its encoder broken."""
        return self._fail(servo_id, "encoder")

    def shock(self, servo_id: int) -> str:
        """Let a servo find an electrical shock."""
        return self._fail(servo_id, "electrical shock")

    def brown_out(self, servo_id: int) -> str:
        """Let a servo restart as a dip of the supply makes it: no status tells."""
        self._bus.here(servo_id).brown_out()
        return f"servo {servo_id} restarts"

    def reset(self, servo_id: int) -> str:
        """Let a servo be as from the factory: id 1, 57600 baud."""
        error = self._bus.here(servo_id).factory_reset(0xFF)
        if error:
            raise ValueError(f"servo {servo_id} refuses with error {error}: its torque is on")
        self._bus.refresh()
        return f"servo {servo_id} is as from the factory: id 1, 57600 bit/s"

    def _fail(self, servo_id: int, error: str) -> str:
        self._bus.here(servo_id).fail(error)
        return f"servo {servo_id} has latched: {error}"

    def reports(self) -> list[dict[str, object]]:
        """Give what the registers of every servo tell."""
        return [self._report(servo_id) for servo_id in self._bus.ids()]

    def _report(self, servo_id: int) -> dict[str, object]:
        servo = self._bus.here(servo_id)
        report: dict[str, object] = {"id": servo_id, "model": servo.model.name}
        for key, (_, address, size) in _REPORTED.items():
            raw = servo.read(address, size) or b""
            report[key] = int.from_bytes(raw, "little", signed=size == 4)
        return report
