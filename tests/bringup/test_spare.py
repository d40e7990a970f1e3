"""A factory-new spare in the place of a missing servo of a chain, adopted by whole commands."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import invoked
from scs_rig import scs_text

from gazerig.config.load import shipped_path
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import BusLost
from gazerig.drivers.serial.port import port_at_path
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.features.bringup.cli.ports import setups_on
from gazerig.features.bringup.servo_kinds import ServoKind, servo_kind
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec

pytestmark = pytest.mark.usefixtures("simulated_wires", "no_real_ports")

YAW = "neck_yaw (servo 7)"


TEXTS: dict[str, Callable[[], str]] = {
    "dynamixel": lambda: shipped_path("rigs", "desk").read_text("utf-8"),
    "feetech": lambda: shipped_path("rigs", "feetech").read_text("utf-8"),
    "scs": scs_text,
}


class Chain:
    """The emulated chain of a rig on one port; servos are made factory-new one after the other."""

    def __init__(self, rig: Rig, file: str, path: str, command: Callable[[str], str]) -> None:
        self.kind: ServoKind = servo_kind(setups_on(rig, "")[6].model)
        self.file, self.path, self.baud = file, path, rig.bus_named("").section.baud
        self.line, self.command = port_at_path(path), command

    def registers(self, baud: int) -> Transactions:
        assert self.line.setBaudRate(baud)
        return Transactions(self.line, self.kind.family)

    def renew(self, servo_id: int, new_id: int = 1) -> None:
        """Give a servo the id and the baud rate of a new one."""
        family = self.kind.family
        rate = family.baud_rates.index(family.factory_baud)
        if self.baud != family.factory_baud:
            # Its answer may already come at the new rate.
            self.open_lock(self.baud, servo_id)
            self.registers(self.baud).write(servo_id, "baud_rate", rate)
        if new_id != servo_id:
            self.open_lock(family.factory_baud, servo_id)
            self.registers(family.factory_baud).write(servo_id, "id", new_id)
        self.line.closePort()

    def open_lock(self, baud: int, servo_id: int) -> None:
        lock = self.kind.family.lock_register
        if lock is not None:
            assert self.registers(baud).write(servo_id, lock, 0)

    def values(self, name: str, ids: range = range(1, 10)) -> list[int | None]:
        registers = self.registers(self.baud)
        return [registers.read(servo_id, name) for servo_id in ids]

    def run(self, *words: str, answers: str = "") -> tuple[int, str]:
        command, *options = words
        done = invoked(command, self.file, "--port", self.path, *options, answers=answers)
        return done.code, done.out + done.err

    def places(self) -> list[tuple[int, int]]:
        """Return ids and rates of all servos that a scan finds."""
        out = invoked("scan", "--port", self.path, "--kind", self.kind.name, "--json").out
        return sorted((one["id"], one["baud"]) for one in json.loads(out)["servos"])


@contextmanager
def chain_of(
    folder: Path, make: str, *more: ServoSpec, baud: int | None = None, first: int = 1
) -> Iterator[Chain]:
    """Serve a chain; first: the id of its first servo."""
    text = TEXTS[make]().replace("baud: 1000000", f"baud: {baud or RATE[make]}")
    text = re.sub(r"(?m)^    id: 1\b", f"    id: {first}", text, count=1)
    file = folder / "rig.yaml"
    file.write_text(text, encoding="utf-8")
    rig = load_rig(str(file))
    (line,) = emulated_lines(rig).values()
    with PtyBuses() as buses:
        extended = type(line)((*line.servos, *more), line.baud)  # type: ignore[arg-type, call-arg]
        (path,) = buses.start({"": extended}).values()
        yield Chain(rig, str(file), path, buses.command)


RATE = {"dynamixel": 1_000_000, "feetech": 500_000, "scs": 500_000}
"""Rates other than the factory's."""

MODEL = {"dynamixel": "xc330-m288", "feetech": "sts3215", "scs": "scs15"}
"""Models of the neck."""

every = pytest.mark.parametrize("make", list(TEXTS))


@pytest.fixture
def writes(monkeypatch: pytest.MonkeyPatch) -> list[tuple[int, str, int]]:
    """Return a list of all writes to registers by name."""
    done: list[tuple[int, str, int]] = []
    write = Transactions.write

    def noted(self: Transactions, servo_id: int, name: str, value: int) -> bool:
        done.append((servo_id, name, value))
        return write(self, servo_id, name, value)

    monkeypatch.setattr(Transactions, "write", noted)
    return done


@every
def test_the_doctor_shows_the_plan_and_carries_it_out_with_fix(
    tmp_path: Path, make: str, writes: list[tuple[int, str, int]]
) -> None:
    with chain_of(tmp_path, make) as chain:
        chain.renew(7)
        before = chain.places()
        writes.clear()
        code, out = chain.run("doctor")
        factory = chain.kind.family.factory_baud
        assert code == 1 and writes == [] and chain.places() == before
        assert f"error {YAW}: does not answer, but a new " in out
        assert f"(id 1 at {factory} bit/s)" in out
        assert f"gives that one id 7 and {chain.baud} bit/s; then gazerig calibrate" in out
        assert "none of the missing" not in out
        code, out = chain.run("doctor", "--fix")
        assert f"{YAW}: id 1 -> 7: done" in out
        after = out.partition("after that:")[2]
        assert code == 0 and "does not answer" not in after
        assert "gazerig doctor --fix" not in after
        assert chain.places() == [(servo_id, chain.baud) for servo_id in range(1, 10)]
        assert chain.values("torque_enable") == [0] * 9
        assert not [one for one in writes if one[1] == "torque_enable"]
        assert {one[0] for one in writes if one[1] in ("id", "baud_rate")} == {1, 7}


@every
def test_setup_gives_a_spare_its_id_in_the_chain(
    tmp_path: Path, make: str, writes: list[tuple[int, str, int]]
) -> None:
    with chain_of(tmp_path, make) as chain:
        chain.renew(7)
        before = chain.places()
        writes.clear()
        # Whichever joint is asked for; "no" leaves it as it is.
        code, out = chain.run("setup", answers="\nn\n" + "s\n" * 8)
        assert code == 0 and "done: 0 of 9" in out
        assert writes == [] and chain.places() == before
        code, out = chain.run("setup", answers="\ny\n")
        assert code == 0 and "done: 9 of 9" in out, out
        assert f"all others of the chain answer, so it is for {YAW}" in out
        assert f"{YAW}: id 1 -> 7" in out
        assert chain.places() == [(servo_id, chain.baud) for servo_id in range(1, 10)]
        assert {one[0] for one in writes} <= {1, 7}
        lock = chain.kind.family.lock_register
        assert lock is None or chain.values(lock) == [1] * 9


@pytest.mark.parametrize("at", ["id", "baud_rate"])
@pytest.mark.parametrize("words", [("doctor", "--fix"), ("setup", "--joint", "neck_yaw", "--yes")])
@every
def test_an_interrupted_adoption_is_continued(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, make: str, words: tuple[str, ...], at: str
) -> None:
    write = Transactions.write

    def cut(self: Transactions, servo_id: int, name: str, value: int) -> bool:
        done = write(self, servo_id, name, value)
        if name == at:
            raise BusLost("the cable was pulled")
        return done

    with chain_of(tmp_path, make) as chain:
        chain.renew(7)
        with monkeypatch.context() as patch:
            patch.setattr(Transactions, "write", cut)
            assert chain.run(*words)[0] != 0
        family = chain.kind.family
        place = (7, chain.baud if at == "baud_rate" else family.factory_baud)
        assert place in chain.places()
        code, out = chain.run(*words) if at == "id" else chain.run("doctor", "--fix")
        assert code == 0, out
        assert chain.places() == [(servo_id, chain.baud) for servo_id in range(1, 10)]
        assert chain.values("torque_enable") == [0] * 9


def refused(chain: Chain, writes: list[tuple[int, str, int]]) -> str:
    """Return what the doctor finds where nothing may be adopted."""
    before = chain.places()
    writes.clear()
    code, out = chain.run("doctor")
    assert code == 1
    assert not [one for one in writes if one[1] in ("id", "baud_rate")]
    fixed = chain.run("doctor", "--fix")[1]
    assert "id 1 ->" not in fixed
    assert chain.run("setup", "--joint", "neck_yaw", "--yes")[0] != 0
    assert chain.run("setup", answers="\n" + "s\n" * 9)[1].count("->") == 0
    assert not [one for one in writes if one[1] in ("id", "baud_rate")]
    assert chain.places() == before
    return out


@every
def test_two_missing_servos_are_named_and_none_is_replaced(
    tmp_path: Path, make: str, writes: list[tuple[int, str, int]]
) -> None:
    with chain_of(tmp_path, make) as chain:
        chain.renew(7)
        chain.renew(9, 50)
        out = refused(chain, writes)
        assert "neck_yaw, neck_roll (servos 7, 9): does not answer" in out
        assert "is none of the missing (neck_yaw (servo 7): " in out
        assert "connect it alone and run gazerig setup" in out


def test_a_spare_of_another_model_is_named_and_left_as_it_is(
    tmp_path: Path, writes: list[tuple[int, str, int]]
) -> None:
    with chain_of(tmp_path, "dynamixel", ServoSpec(20, "xl330-m077")) as chain:
        chain.command("lose 7")
        chain.renew(20)
        out = refused(chain, writes)
        assert "servo 1 (xl330-m077) answers at 57600 bit/s and is none of the missing" in out
        assert "(neck_yaw (servo 7): xc330-m288)" in out


@every
def test_two_spares_are_named_and_none_is_used(
    tmp_path: Path, make: str, writes: list[tuple[int, str, int]]
) -> None:
    model = MODEL[make]
    more = (ServoSpec(20, model, 300), ServoSpec(21, model, 700))
    with chain_of(tmp_path, make, *more) as chain:
        chain.command("lose 7")
        chain.renew(20)
        chain.renew(21)
        out = refused(chain, writes)
        assert f"error {YAW}: does not answer" in out
        assert "connect one of them alone and run gazerig setup" in out


@pytest.mark.parametrize("make", ["feetech", "scs"])
def test_a_spare_with_the_id_of_a_servo_is_named_and_not_used(
    tmp_path: Path, make: str, writes: list[tuple[int, str, int]]
) -> None:
    with chain_of(tmp_path, make, baud=1_000_000) as chain:
        chain.renew(7)
        out = refused(chain, writes)
        assert "left_eye_pan (servo 1): " in out and "two servos share" in out


@every
def test_a_servo_whose_answers_are_spoilt_is_not_replaced(
    tmp_path: Path, make: str, writes: list[tuple[int, str, int]]
) -> None:
    with chain_of(tmp_path, make, ServoSpec(20, MODEL[make])) as chain:
        chain.renew(20)
        chain.command("corrupt 7")
        refused(chain, writes)
