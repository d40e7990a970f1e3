"""Search for servos and boards of any kind on a port; nothing is changed and nothing moves.

Reasons for the order and for what is sent:

- To a Maestro every byte from 80 on is a command, and FF moves a servo (FF, channel,
  target). Packets of smart servos begin with FF. So a port of Pololu's is searched for a
  Maestro only, and every other port is searched for one first. Queries to a Maestro
  contain no FF, so no servo can mistake them for the header of a packet. After an answer of a
  Maestro nothing else is sent.
- Dynamixel servos accept FF FF FD 00, STS servos FF FF, an id and a length of 2 or more. To
  an STS a Dynamixel packet has the id 253 and the length 0, which is invalid; to a Dynamixel an
  STS packet has no 00 behind FD, or no FD. Even a servo that accepted the other packets would
  only be pinged or read: nothing else is ever sent here.

A board that receives data but cannot answer (one wire, serial pins at another rate) is not
detected: with such a board on the line, specify the kind of servo.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.drivers.maestro.board import USB_CHANNELS, DetectedMaestro, MaestroParams, probe
from gazerig.drivers.serial.list_ports import POLOLU
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import FoundServo
from gazerig.features.bringup.servo_kinds import KINDS
from gazerig.features.bringup.servo_setup import Answers, search_rate

ORDER: tuple[BusKind, ...] = ("maestro", "dynamixel", "feetech")
"""Order of the search by kind; see above."""

RATES: Mapping[BusKind, Sequence[int]] = {
    "maestro": (MaestroParams().baud,),
    # The usual rate first, then that of the factory.
    **{
        kind.name: tuple(
            dict.fromkeys((1_000_000, kind.family.factory_baud, *kind.family.baud_rates))
        )
        for kind in KINDS.values()
    },
}


class SearchRound(NamedTuple):
    """Result of the search for one kind at one baud rate.

    answers: of servos, None if the adaptor does not support the rate, or for a board
    board: a Maestro; channels: number of its channels, None if unknown
    """

    kind: BusKind
    baud: int
    answers: Answers | None = None
    board: DetectedMaestro | None = None
    channels: int | None = None

    @property
    def found(self) -> tuple[FoundServo, ...]:
        """Return the servos that answered."""
        return () if self.answers is None else self.answers.found

    @property
    def has_answer(self) -> bool:
        """Return whether a servo of this kind has answered."""
        return bool(self.found) or self.board is not None


def plan_search(usb: str, kinds: Sequence[BusKind]) -> tuple[tuple[BusKind, int], ...]:
    """Return the kinds and rates to search, in order.

    usb: vendor and product id of the port, "" if it has none
    """
    if usb.startswith(POLOLU):
        return (("maestro", MaestroParams().baud),) if "maestro" in kinds else ()
    return tuple((kind, rate) for kind in ORDER if kind in kinds for rate in RATES[kind])


def search_bus(
    port: BusPort,
    usb: str,
    asked: Sequence[tuple[BusKind, int]],
    thorough: bool = False,
) -> Iterator[SearchRound]:
    """Search for one kind after the other; end after the first kind that replies.

    asked: result of ``plan_search``
    thorough: wait longer for Dynamixel servos, and ping each STS id even if no servo answers a
        broadcast ping

    Raises:
        PortError: the port cannot be opened.
        BusLost: it has disappeared.

    """
    met: BusKind | None = None
    for kind, baud in asked:
        if met not in (None, kind):
            return
        looked = SearchRound(kind, baud)
        if kind != "maestro":
            looked = SearchRound(kind, baud, search_rate(port, KINDS[kind], baud, thorough))
        elif port.setBaudRate(baud):
            # Every board has the first six channels; others might cause an error.
            board = probe(port, MaestroParams())
            looked = SearchRound(kind, baud, board=board, channels=USB_CHANNELS.get(usb))
        met = kind if looked.has_answer else met
        yield looked


def found_servos(rounds: Iterable[SearchRound]) -> list[tuple[BusKind, FoundServo]]:
    """Return all servos that answered, with their kinds."""
    return [(one.kind, servo) for one in rounds for servo in one.found]
