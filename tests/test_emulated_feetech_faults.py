"""Faults of emulated STS servos: error bits, protections, restarts, their line."""

import pytest
from servo_bench import ALL, READ, SYNC_READ, FeetechBench

from gazerig.sim_mock.smart_servo.physics import Physics, ServoSpec

VOLTAGE, ANGLE, HEAT, CURRENT, OVERLOAD = 1, 2, 4, 8, 32


def jammed(goal=3000, **physics):
    """A servo that pushes against something."""
    bench = FeetechBench(ServoSpec(1, "sts3215", 2048, physics=Physics(**physics)))
    bench.enable_torque()
    bench.chain.faults.command("stick 1")
    bench.write(1, 42, goal, 2)
    return bench


# --- what it flags


@pytest.mark.parametrize(("volts", "bits"), [(8.0, 0), (8.2, 1), (3.9, 1)])
def test_voltage_stands_in_every_answer_as_long_as_it_is_wrong(volts, bits):
    bench = FeetechBench()
    bench.chain.faults.command(f"voltage 1 {volts}")
    bench.wait(0.1)
    assert bench.read(1, 62) == round(volts * 10)
    assert bench.read(1, 65) == bits
    assert [error for _, error, _ in bench.ask(1, READ, 0, 5)] == [bits]
    assert [error for _, error, _ in bench.ask(ALL, SYNC_READ, 56, 2, 1)] == [bits]
    assert bench.write(1, 41, 1) == bits
    bench.chain.faults.command("voltage 1 7.4")
    bench.wait(0.1)
    assert bench.error() == 0


def test_heat_takes_the_torque_until_it_has_cooled_and_someone_switches_it_on():
    bench = FeetechBench()
    bench.enable_torque()
    bench.chain.faults.command("overheat 1")
    bench.wait(0.04)
    assert (bench.error(), bench.read(1, 40), bench.read(1, 63)) == (HEAT, 0, 75)
    bench.write(1, 40, 1)
    assert bench.read(1, 40) == 0
    bench.wait(120.0)
    assert (bench.error(), bench.read(1, 40)) == (0, 0)
    bench.write(1, 40, 1)
    assert bench.read(1, 40) == 1


# --- overload


def test_an_overload_lowers_the_torque_after_its_time():
    bench = jammed()
    bench.wait(1.9)
    assert (bench.error(), bench.read(1, 60, 2, 10)) == (0, 1000)
    bench.wait(0.2)
    assert (bench.error(), bench.read(1, 60, 2, 10)) == (OVERLOAD, 200)
    assert bench.read(1, 40) == 1
    bench.chain.faults.command("free 1")
    bench.wait(5.0)
    assert bench.error() == OVERLOAD


def test_a_torque_limit_below_it_never_overloads():
    bench = jammed()
    bench.write(1, 48, 790, 2)
    bench.wait(10.0)
    assert (bench.error(), bench.read(1, 60, 2, 10)) == (0, 790)


# --- the line


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("lose 1 count 1", ""),
        ("corrupt 1 5 count 1", "df ff 01 04 00 00 08 f2"),
        ("wrong-id 1 9 count 1", "ff ff 09 04 00 00 08 ea"),
        ("short 1 1 count 1", "ff ff 01 03 00 00 fb"),
        ("refuse 1 0x20 count 1", "ff ff 01 02 20 dc"),
        ("fragment 1 count 1", "ff ff ff ff 01 04 00 00 08 f2"),
    ],
)
def test_faults_of_the_line_to_the_byte(fault, said):
    bench = FeetechBench()
    bench.chain.faults.command(fault)
    assert bench.chain.receive(FeetechBench.instruction(1, READ, 56, 2)).hex(" ") == said
    assert bench.position() == 2048
