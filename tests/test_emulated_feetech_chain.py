"""The emulated STS bus against the written rules: instructions, memory, lock, groups, quirks."""

import pytest
from servo_bench import ALL, PING, FeetechBench

from gazerig.drivers.feetech import memory_table as feetech_table
from gazerig.sim_mock.feetech.memory import STS


def three(**options):
    return FeetechBench(*[(i, "sts3215", 1000.0 * i) for i in (1, 2, 3)], **options)


def restart(bench, servo_id=1):
    """Cut the power for a moment."""
    bench.chain.faults.command(f"brown-out {servo_id}")
    bench.wait(1.0)


# --- who is there


@pytest.fixture
def bench():
    return FeetechBench()


def test_registers_lie_where_the_drivers_table_has_them():
    theirs = {(r.address, r.size, r.sign) for r in feetech_table.REGISTERS.values()}
    own = (*STS.permanent, *STS.ram, *STS.fixed)
    ours = {(r.address, r.size, r.sign) for r in own}
    live = {at for at, _, _ in theirs} & set(range(56, 71))
    assert {row for row in theirs if row[0] not in live} <= ours
    bench = FeetechBench()
    differ = {
        r.name
        for r in feetech_table.registers_of(feetech_table.MODELS["sts3215"])
        if r.initial is not None
        and r.area == "eeprom"
        and bench.read(1, r.address, r.size) != r.initial
    }
    # how servos leave the factory is reported differently
    assert differ <= {"firmware_minor", "return_delay_time", "velocity_i_gain"}


def test_a_model_that_is_not_feetechs_is_refused():
    with pytest.raises(ValueError, match=r"model 'xl330-m288': Feetech servos are sts3215"):
        FeetechBench((1, "xl330-m288", 0.0))


# --- writes


def test_read_only_registers_stay_and_nobody_complains(bench):
    for address in (0, 3, 56, 62, 65):
        before = bench.read(1, address)
        assert bench.write(1, address, before ^ 0x55) == 0
        assert bench.read(1, address) == before


@pytest.mark.parametrize(("address", "value", "stays"), [(5, 254, 1), (6, 8, 0), (33, 4, 0)])
def test_ids_bauds_and_modes_that_do_not_exist_change_nothing(bench, address, value, stays):
    bench.write(1, address, value)
    assert bench.read(1, address) == stays


def test_only_what_is_written_while_it_is_open_is_kept(bench):
    bench.write(1, 22, 5)
    bench.write(1, 55, 0)
    bench.write(1, 21, 16)
    bench.write(1, 55, 1)
    bench.write(1, 23, 7)
    restart(bench)
    assert [bench.read(1, at) for at in (21, 22, 23, 55)] == [16, 32, 0, 1]


# --- groups


@pytest.mark.parametrize(("policy", "ids"), [("answer", [1, 2, 3]), ("silence", [])])
def test_broadcast_ping(policy, ids):
    bench = three()
    bench.chain.choose_behaviour("broadcast-ping", policy)
    assert [i for i, _, _ in bench.ask(ALL, PING)] == ids
