"""A whole rig on its emulated buses in this process, in simulated time."""

from collections.abc import Mapping
from math import degrees

from gazerig.config.schema import Rig
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.run.emulated import emulated_lines, servo_index
from gazerig.sim_mock.devices import Emulated, build
from gazerig.sim_mock.in_process_port import InProcessPort


class EmulatedRig:
    """A rig's buses by name: what is emulated, its port, and the packets sent to it."""

    def __init__(self, rig: Rig, lines: Mapping[str, Emulated] | None = None) -> None:
        self.rig, self.clock = rig, SimulatedClock()
        self.lines = emulated_lines(rig) if lines is None else lines
        self.devices = {name: build(line, self.clock.now_s) for name, line in self.lines.items()}
        self.sent: dict[str, list[bytes]] = {name: [] for name in self.lines}
        self.ports = {
            name: InProcessPort(device, self.sent[name].append, sleep_until=self.clock.sleep_until)
            for name, device in self.devices.items()
        }

    def command(self, text: str, bus: str = "") -> str:
        """Let something happen to what is emulated on a bus."""
        return self.ports[bus].faults.command(text)

    def where(self) -> dict[str, float]:
        """Return the true joint angles in degrees."""
        return {
            name: degrees(
                joint.angle_rad(
                    self.devices[joint.bus].positions_steps()[servo_index(self.rig, name)]
                )
            )
            for name, joint in self.rig.joints.items()
        }
