"""One emulated Dynamixel servo alone: registers, torque, protections."""

from gazerig.drivers.dynamixel.control_table import MODELS
from gazerig.sim_mock.dynamixel.servo import DynamixelServo, registers_of
from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec


class Bench:
    """A servo, its registers by their addresses, and its clock in milliseconds."""

    def __init__(self, model="xl330-m077", start=2048, **physics):
        self.servo = DynamixelServo(ServoSpec(1, model, start, 53, Physics(**physics)), 0)
        self.registers = {register.address: register for register in registers_of(MODELS[model])}
        self.ms = 0

    def put(self, address, value):
        """Write one register; give the error number."""
        size = self.registers[address].size
        return self.servo.write(address, value.to_bytes(size, "little", signed=value < 0))

    def get(self, address):
        register = self.registers[address]
        return register.decode(self.servo.read(address, register.size)[1])

    def at(self, ms):
        """Let time pass until then; give whether it listens."""
        self.ms = ms
        return self.servo.advance(ms, ms)


# --- protections against load, heat and voltage


def test_a_jammed_joint_overloads_after_its_time_and_only_a_reboot_clears_it():
    bench = Bench()
    bench.put(64, 1)
    bench.servo.jam()
    bench.put(116, 4000)
    bench.at(1900)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (0, 1, 0)
    bench.at(2100)
    assert (bench.get(70), bench.get(64), bench.servo.error_flag) == (0x20, 0, 0x80)
    assert (bench.get(124), bench.get(126)) == (0, 0)
    bench.servo.jam(False)
    assert (bench.put(64, 1), bench.get(64)) == (0, 0)
    bench.servo.restart()
    assert not bench.at(2400)
    assert bench.at(2600)
    assert (bench.get(70), bench.put(64, 1), bench.get(64)) == (0, 0, 1)
