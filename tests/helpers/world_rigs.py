"""Rigs in a world with physics, for tests."""

from pathlib import Path
from typing import Any

from gazerig.config.schema import Rig, load_rig
from gazerig.features.world.figure import Figures
from gazerig.features.world.run.run_world import rig_in_world
from gazerig.robot.run.emulated import emulated_lines, servo_index
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.scenes.script import SceneScript

NOBODY = Figures(SceneScript({}, "none"))


class WorldBench:
    """A shipped rig twice on one clock: its servos in a world, and with mechanics of their own."""

    def __init__(self, rig: str | Rig, mjcf_file: Path | None = None) -> None:
        from gazerig.features.world.model import world_model
        from gazerig.features.world.physics import World

        self.now_s = 0.0
        self.rig = load_rig(rig) if isinstance(rig, str) else rig
        self.world = World(
            world_model(NOBODY, rig_in_world(self.rig, looks=False), mjcf_file), lambda: self.now_s
        )
        lines = emulated_lines(self.rig)
        self.devices: dict[str, Any] = {
            bus: self.world.device(line, bus) for bus, line in lines.items()
        }
        self.own_devices: dict[str, Any] = {
            bus: build(line, lambda: self.now_s) for bus, line in lines.items()
        }
        self.servos = self._by_joint(self.devices)
        self.own = self._by_joint(self.own_devices)

    def _by_joint(self, devices: dict[str, Any]) -> dict[str, Any]:
        servos = {bus: getattr(one, "body", one).servos for bus, one in devices.items()}
        return {n: servos[self.rig.joints[n].bus][servo_index(self.rig, n)] for n in self.rig.names}

    def pass_ms(self, ms: int) -> None:
        """Let time pass for both."""
        self.now_s += ms / 1000.0
        for device in (*self.devices.values(), *self.own_devices.values()):
            device.positions_steps()

    def both(self, joint: str) -> tuple[Any, Any]:
        """Return the servo of a joint in the world, and that with mechanics of its own."""
        return self.servos[joint], self.own[joint]


def write(servo: Any, name: str, value: int) -> None:
    """Write a register as an instruction does."""
    register = servo.memory.registers[name]
    assert (
        servo.write(register.address, value.to_bytes(register.size, "little", signed=value < 0))
        == 0
    )


def read(servo: Any, name: str) -> int:
    """Return a register as an instruction reads it."""
    register = servo.memory.registers[name]
    return int.from_bytes(servo.read(register.address, register.size)[1], "little", signed=True)


def arm(servo: Any, gains: tuple[int, ...] = ()) -> None:
    """Let a smart servo hold its position, with position gains P, I and D where they are given."""
    names = ("position_p_gain", "position_i_gain", "position_d_gain")
    for register, gain in zip(names, gains, strict=False):
        write(servo, register, gain)
    write(servo, "goal_position", round(servo.position_steps))
    if "goal_speed" in servo.memory.registers:
        write(servo, "goal_speed", 3400)
    write(servo, "torque_enable", 1)
