"""One emulated joint on a bench, with a person who turns it and answers."""

from collections.abc import Callable

from gazerig.drivers.servo_bus.registers import Registers
from gazerig.features.bringup.calibration.endstop_search import StopSearchParams
from gazerig.features.bringup.calibration.smart_servo_access import (
    CalibrationStopped,
    SingleJoint,
    SingleServo,
)
from gazerig.features.bringup.servo_families import kind_of
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.joint import JointParams
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

EYE = JointParams(1, "xl330-m077", -35.0, 35.0, 600.0, 45000.0)


NECK = JointParams(7, "xc330-m288", -35.0, 35.0, 200.0, 2000.0)


STS = JointParams(3, "sts3215", -35.0, 35.0, 300.0, 20000.0)


GENTLY = StopSearchParams()


FREE = (-1e9, 1e9)


class Bench:
    """One emulated servo between stops, and a person with a script."""

    def __init__(
        self, joint: JointParams, start: int = 2100, stops: tuple[float, float] = FREE
    ) -> None:
        self.clock = SimulatedClock()
        physics = Physics(stop_low_steps=stops[0], stop_high_steps=stops[1])
        spec = ServoSpec(joint.id, joint.model, start, physics=physics)
        build = build_feetech if joint is STS else build_dynamixel
        self.chain = build([spec], self.clock.now_s)
        self.port = InProcessPort(self.chain, sleep_until=self.clock.sleep_until)
        self.port.setBaudRate(1_000_000)
        self.kind = kind_of(joint.model)
        self.registers = Registers(self.port, self.kind.family)
        self.why: str | None = None
        self.id = joint.id
        self.script: list[int] = []
        self.said: list[str] = []
        self.agreed = True
        name = "neck_yaw" if joint is NECK else "left_eye_pan"
        self.servo = SingleServo(name, joint.id, joint.model, self.port)
        self.joint = SingleJoint(name, joint, self.servo, self.clock, lambda: self.why)

    def get(self, register: str) -> int:
        value = self.registers.read(self.id, register)
        assert value is not None
        return value

    def put(self, register: str, value: int) -> None:
        assert self.registers.write_persistent(self.id, register, value)

    def limits(self) -> tuple[int, int]:
        return self.get("min_position_limit"), self.get("max_position_limit")

    def restart(self) -> None:
        self.chain.faults.command(f"brown-out {self.id}")
        self.clock.sleep_until(self.clock.now_s() + 1.0)

    def command(self, text: str) -> None:
        self.port.faults.command(text.format(id=self.id))
        self.clock.sleep_until(self.clock.now_s() + 0.1)

    # gazerig.features.bringup.calibration.joint_procedure.Operator

    def tell(self, line: str) -> None:
        self.said.append(line)

    def wait(self, question: str, live: Callable[[], str]) -> None:
        self.said.append(question)
        if not self.script:
            raise CalibrationStopped("stopped by you")
        left = self.script.pop(0)
        while left:
            step = max(-100, min(100, left))
            self.chain.here(self.id).turn(step)
            left -= step
            self.clock.sleep_until(self.clock.now_s() + 0.04)
            live()

    def agrees(self, question: str, live: Callable[[], str]) -> bool:
        self.said.append(question)
        live()
        return self.agreed
