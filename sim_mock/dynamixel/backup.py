"""The stored copy of an emulated servo's control table (instruction 0x20).

What exactly is stored no document tells; here everything that may be written, except
what moves the servo.
"""

from gazerig.sim_mock.dynamixel.memory import DynamixelMemory, in_eeprom

NOT_STORED = (
    "torque_enable", "bus_watchdog", "goal_pwm", "goal_current", "goal_velocity", "goal_position",
)  # fmt: skip


class Backup:
    """A copy that survives restarts; empty at first."""

    def __init__(self) -> None:
        self._stored: dict[str, int] = {}

    @property
    def ready(self) -> bool:
        """True if there is something to restore."""
        return bool(self._stored)

    def store(self, memory: DynamixelMemory) -> None:
        """Copy the control table."""
        names = [register.name for register in memory.writable()]
        self._stored = {name: memory.get(name) for name in names if name not in NOT_STORED}

    def recall(self, memory: DynamixelMemory, eeprom: bool) -> None:
        """Put one area back, the EEPROM's or the RAM's."""
        for name, value in self._stored.items():
            if in_eeprom(memory.named(name)) == eeprom:
                memory.set(name, value)
