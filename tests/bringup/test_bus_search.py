"""Searching a port for every kind: servos are found, and none is moved or changed."""

import pytest

from gazerig.features.bringup.bus_search import (
    ORDER,
    found_servos,
    plan_search,
    search_bus,
)
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.sim_mock.smart_servo.physics import ServoSpec

FEW = (1_000_000, 57_600)
MICRO, MINI = "1ffb:0089", "1ffb:008a"


class Line:
    """A port in this process, and all that was sent through it."""

    def __init__(self, device):
        self.device, self.sent = device, b""
        self.port = InProcessPort(device, self.tap)

    def tap(self, data):
        self.sent += data

    def search(self, rates=FEW, usb="", kinds=ORDER, thorough=False):
        return list(search_bus(self.port, usb, plan_search(usb, kinds, rates), thorough))


# --- a board is never sent what moves it

BOARDS = {
    "as from the shop": build_board(12, lambda: 0.0),
    "micro": build_board(6, lambda: 0.0),
    "with check bytes": build_board(12, lambda: 0.0, crc=True),
}


@pytest.mark.parametrize("board", BOARDS.values(), ids=list(BOARDS))
def test_a_board_is_recognised_before_anything_could_move_it(board):
    board.exchange(bytes.fromhex("8403102F"))
    before = [one["target"] for one in board.faults.reports()]
    line = Line(board)
    rounds = line.search(rates=None)
    assert rounds[-1].board is not None and {one.kind for one in rounds} == {"maestro"}
    assert b"\xff" not in line.sent
    assert [one["target"] for one in board.faults.reports()] == before


def test_a_port_of_pololu_is_never_sent_servo_packets_even_where_nobody_answers():
    board = build_board(12, lambda: 0.0)
    board.faults.command("lose all")
    line = Line(board)
    (only,) = line.search(usb=MINI, rates=None)
    assert only.board is None and line.sent and b"\xff" not in line.sent
    for kind in ("dynamixel", "feetech"):
        assert plan_search(MINI, (kind,), None) == ()
    assert plan_search(MICRO, ORDER, (1_000_000,)) == (("maestro", 115_200),)


# --- servos of each kind hear the other's packets and are left as they are


def memory(servo):
    return bytes(servo.memory.bytes[:80])


def test_dynamixel_servos_are_found_and_the_search_ends_there():
    chain = build_dynamixel([ServoSpec(1, "xl330-m077"), ServoSpec(7, "xc330-m288")], lambda: 0.0)
    rounds = Line(chain).search()
    assert {one.kind for one in rounds} == {"maestro", "dynamixel"}
    kinds = {(kind, servo.id) for kind, servo in found_servos(rounds)}
    assert kinds == {("dynamixel", 1), ("dynamixel", 7)}


def test_no_packet_changes_dynamixel_servos():
    chain = build_dynamixel([ServoSpec(i, "xl330-m077") for i in (1, 2, 253 - 1)], lambda: 0.0)
    for servo in chain.servos:
        servo.memory.set("return_delay_time", 77)
    before = [memory(servo) for servo in chain.servos]
    places = chain.positions_steps()
    line = Line(chain)
    rounds = line.search(kinds=("feetech",), thorough=True) + line.search(thorough=True)
    assert {one.kind for one in rounds} == set(ORDER)
    assert bytes.fromhex("FFFF0104020009") in line.sent  # an STS packet went over the line
    assert [memory(servo) for servo in chain.servos] == before
    assert chain.positions_steps() == places
    assert not any(one.found for one in rounds if one.kind == "feetech")


def test_no_packet_changes_sts_servos():
    chain = build_feetech([ServoSpec(i, "sts3215", 1900 + i) for i in (1, 49, 253)], lambda: 0.0)
    before = [chain[i].read(0, 56) for i in (1, 49, 253)]
    places = chain.positions_steps()
    rounds = Line(chain).search(thorough=True)
    assert {(kind, servo.id) for kind, servo in found_servos(rounds)} == {
        ("feetech", 1), ("feetech", 49), ("feetech", 253),
    }  # fmt: skip
    assert [chain[i].read(0, 56) for i in (1, 49, 253)] == before
    assert chain.positions_steps() == places
    assert not any(one.found for one in rounds if one.kind == "dynamixel")
