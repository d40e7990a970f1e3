"""Finding a Maestro: what answers, what it held, and that nothing moves."""

import pytest
from present import present

from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.maestro.probe import USB_CHANNELS, probe
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board


def make(channels=12, crc=False):
    board = build_board(channels, lambda: 0.0, crc=crc)
    return board, InProcessPort(board)


def send(board, text):
    board.exchange(bytes.fromhex(text))


def errors(board):
    return board.faults.board_status()["errors"]


def test_a_board_as_from_the_shop():
    _, port = make()
    found = probe(port, MaestroParams())
    assert found is not None
    assert (found.expects_crc, found.errors, found.is_script_running, found.channels) == (
        False,
        (),
        False,
        None,
    )
    assert found.pulses == (0,) * 6


def test_pulses_stay_as_they_are_and_no_error_is_made():
    board, port = make()
    send(board, "84 00 70 2E 84 04 08 27")
    found = probe(port, MaestroParams(), count=True)
    assert found is not None and found.pulses == (6000, 0, 0, 0, 5000, 0)
    assert found.channels is None
    assert errors(board) == []
    assert [channel["position"] for channel in board.faults.reports()[:5]] == [6000, 0, 0, 0, 5000]


@pytest.mark.parametrize("channels", sorted(USB_CHANNELS.values()))
def test_channels_are_counted_where_that_is_wished(channels):
    board, port = make(channels)
    found = probe(port, MaestroParams(), count=True)
    assert found is not None
    assert found.channels == channels == len(found.pulses)
    assert found.errors == () and errors(board) == []


def test_what_the_register_held_is_told():
    board, port = make()
    send(board, "55")
    found = probe(port, MaestroParams())
    assert found is not None and found.errors == ("serial protocol error",)
    assert present(probe(port, MaestroParams())).errors == ()


@pytest.mark.parametrize("wanted", [False, True])
@pytest.mark.parametrize("real", [False, True])
def test_the_check_byte_is_found_out(wanted, real):
    _, port = make(crc=real)
    found = probe(port, MaestroParams(crc=wanted))
    assert found is not None and found.expects_crc is real


def test_nobody_answers():
    board, port = make()
    board.choose_behaviour("mode", "mute")
    assert probe(port, MaestroParams()) is None
