"""A factory-new spare in the place of a missing servo of a chain, adopted by whole commands."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from command_line import invoked

from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import BusLost
from gazerig.drivers.serial.port import port_at_path
from gazerig.drivers.servo_bus.discovery import ping
from gazerig.drivers.servo_bus.transaction import Transactions
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.cli.ports import setups_on
from gazerig.features.bringup.servo_kinds import servo_kind
from gazerig.features.bringup.servo_setup import (
    Answers,
    assign_servo,
    find_spare,
    open_at,
    search_rates,
)
from gazerig.robot.run.emulated import emulated_lines
from gazerig.sim_mock.pty.client import PtyBuses
from gazerig.sim_mock.smart_servo.physics import ServoSpec

pytestmark = pytest.mark.usefixtures("simulated_wires", "no_real_ports")

YAW = "neck_yaw (servo 7)"
BAUD = {"desk": 1_000_000, "feetech": 500_000}
"""Rates other than the factory's."""
every = pytest.mark.parametrize("name", list(BAUD))
commands = pytest.mark.parametrize(
    "words", [("doctor", "--fix"), ("setup", "--joint", "neck_yaw", "--yes")]
)
Write = tuple[int, str, int]


def quiet(_: str) -> None:
    """Show no progress."""


class Chain:
    """The emulated chain of a rig on one port."""

    def __init__(self, file: str, path: str) -> None:
        rig = load_rig(file)
        self.file, self.path, self.setups = file, path, setups_on(rig, "")
        self.kind, self.baud = servo_kind(self.setups[6].model), rig.bus_named("").section.baud

    def renew(self, setup: ServoConfig, new_id: int = 1) -> None:
        """Give a servo first the baud rate of a new one, then its id."""
        line, baud = port_at_path(self.path), self.baud
        for next_id in (setup.id, new_id):
            open_at(line, baud)
            found = ping(line, self.kind.family, setup.id, baud)
            assert found is not None
            baud = self.kind.family.factory_baud
            assign_servo(line, self.kind, found, setup._replace(id=next_id), baud, quiet)
        line.closePort()

    def run(self, command: str, *options: str, answers: str = "") -> tuple[int, str]:
        done = invoked(command, self.file, "--port", self.path, *options, answers=answers)
        return done.code, done.out + done.err

    def places(self) -> list[tuple[int, int]]:
        """Return ids and rates of all servos that a scan finds."""
        out = invoked("scan", "--port", self.path, "--kind", self.kind.name, "--json").out
        return sorted((one["id"], one["baud"]) for one in json.loads(out)["servos"])

    @property
    def whole(self) -> list[tuple[int, int]]:
        return [(servo_id, self.baud) for servo_id in range(1, 10)]


@contextmanager
def chain_of(folder: Path, name: str, *more: ServoSpec, command: str = "") -> Iterator[Chain]:
    """Serve a chain with more servos than in the rig; command: a fault."""
    text = shipped_path("rigs", name).read_text("utf-8")
    file = folder / "rig.yaml"
    file.write_text(text.replace("baud: 1000000", f"baud: {BAUD[name]}"), encoding="utf-8")
    (line,) = emulated_lines(load_rig(str(file))).values()
    with PtyBuses() as buses:
        extended = type(line)((*line.servos, *more), line.baud)  # type: ignore[arg-type, call-arg]
        (path,) = buses.start({"": extended}).values()
        if command:
            buses.command(command)
        yield Chain(str(file), path)


@pytest.fixture
def writes(monkeypatch) -> list[Write]:
    """Return a list of all writes of ids and baud rates."""
    done: list[Write] = []
    write = Transactions.write

    def noted(self: Transactions, servo_id: int, name: str, value: int) -> bool:
        if name in ("id", "baud_rate"):
            done.append((servo_id, name, value))
        return write(self, servo_id, name, value)

    monkeypatch.setattr(Transactions, "write", noted)
    return done


@every
def test_the_doctor_offers_a_spare_and_adopts_it_with_fix(tmp_path, name, writes):
    with chain_of(tmp_path, name) as chain:
        chain.renew(chain.setups[6])
        before = chain.places()
        writes.clear()
        code, out = chain.run("doctor")
        assert code == 1 and not writes and chain.places() == before
        assert f"error {YAW}: does not answer, but a new " in out
        assert f"gives that one id 7 and {chain.baud} bit/s; then gazerig calibrate" in out
        assert "none of the missing" not in out
        code, out = chain.run("doctor", "--fix")
        assert code == 0 and f"{YAW}: id 1 -> 7: done" in out
        assert "does not answer" not in out.partition("after that:")[2]
        assert chain.places() == chain.whole
        assert [one[:2] for one in writes] == [(1, "id"), (7, "baud_rate")]


@commands
@every
def test_an_adoption_interrupted_between_id_and_rate_is_finished_by_a_second_run(
    monkeypatch, tmp_path, name, words
):
    write = Transactions.write

    def cut(self: Transactions, servo_id: int, name: str, value: int) -> bool:
        done = write(self, servo_id, name, value)
        if name == "id":
            raise BusLost("the cable was pulled")
        return done

    with chain_of(tmp_path, name) as chain:
        chain.renew(chain.setups[6])
        with monkeypatch.context() as patch:
            patch.setattr(Transactions, "write", cut)
            assert chain.run(*words)[0] != 0
        assert (7, chain.kind.family.factory_baud) in chain.places()
        code, out = chain.run(*words)
        assert code == 0, out
        assert chain.places() == chain.whole


def is_refused(chain: Chain, writes: list[Write], *words: str) -> bool:
    """Return whether the doctor names servos with these words, and nothing adopts one."""
    writes.clear()
    _, out = chain.run("doctor", "--fix")
    failed = chain.run("setup", "--joint", "neck_yaw", "--yes")[0] != 0
    chain.run("setup", answers="\n" + "s\n" * 9)
    return failed and not writes and all(text in out for text in words)


@every
def test_two_missing_servos_are_named_and_none_is_replaced(tmp_path, name, writes):
    with chain_of(tmp_path, name, command="lose 9") as chain:
        chain.renew(chain.setups[6])
        named = "neck_yaw, neck_roll (servos 7, 9): does not answer"
        assert is_refused(chain, writes, named, "is none of the missing (neck_yaw (servo 7): ")


def test_a_spare_of_another_model_is_named(tmp_path, writes):
    small = ServoSpec(20, "xl330-m077")
    with chain_of(tmp_path, "desk", small, command="lose 7") as chain:
        chain.renew(chain.setups[0]._replace(id=20))
        assert is_refused(chain, writes, "servo 1 (xl330-m077) answers at 57600 bit/s and is none")


def test_a_servo_whose_answer_was_lost_is_not_replaced(tmp_path):
    with chain_of(tmp_path, "desk") as chain:
        kind, baud = chain.kind, chain.baud
        line, factory = port_at_path(chain.path), kind.family.factory_baud
        found = search_rates(line, kind, (baud,), quiet)[baud].found
        spare = found[6]._replace(id=1, baud=factory)
        answers = {baud: Answers(found[:6] + found[7:]), factory: Answers((spare,))}
        assert find_spare(line, kind, chain.setups, baud, answers) is None
        line.closePort()
