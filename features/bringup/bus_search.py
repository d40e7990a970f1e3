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
from dataclasses import dataclass

from gazerig.drivers.bus.servo_models import FAMILY_OF, BusKind
from gazerig.drivers.maestro.board import USB_CHANNELS, DetectedMaestro, MaestroParams, probe
from gazerig.drivers.serial.list_ports import POLOLU
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.discovery import (
    SHARED,
    FoundServo,
    count_corrupt,
    has_any_reply,
    scan_ids,
)
from gazerig.features.bringup.servo_kinds import KINDS

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


@dataclass(frozen=True)
class SearchRound:
    """Result of the search for one kind at one baud rate.

    is_supported: whether the adaptor supports the rate; unknown_bytes: bytes that are not valid
    shared_ids: ids that two servos seem to have
    board: a Maestro; channels: number of its channels, None if unknown
    """

    kind: BusKind
    baud: int
    is_supported: bool = True
    found: tuple[FoundServo, ...] = ()
    unknown_bytes: int = 0
    shared_ids: tuple[int, ...] = ()
    board: DetectedMaestro | None = None
    channels: int | None = None

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
        if kind != "maestro":
            looked = _search_servos(port, kind, baud, thorough)
        elif port.setBaudRate(baud):
            # Every board has the first six channels; others might cause an error.
            board = probe(port, MaestroParams())
            looked = SearchRound(kind, baud, board=board, channels=USB_CHANNELS.get(usb))
        else:
            looked = SearchRound(kind, baud, is_supported=False)
        met = kind if looked.has_answer else met
        yield looked


def _search_servos(port: BusPort, kind: BusKind, baud: int, thorough: bool) -> SearchRound:
    family = KINDS[kind].family
    if not port.setBaudRate(baud):
        return SearchRound(kind, baud, is_supported=False)
    if not thorough and not has_any_reply(port, family):
        return SearchRound(kind, baud)
    found, junk = scan_ids(port, family, baud)
    tables = {one.id: FAMILY_OF.get(one.model, family) for one in found}
    shared = tuple(i for i, table in tables.items() if count_corrupt(port, table, i) >= SHARED)
    return SearchRound(kind, baud, found=found, unknown_bytes=junk, shared_ids=shared)


def found_servos(rounds: Iterable[SearchRound]) -> list[tuple[BusKind, FoundServo]]:
    """Return all servos that answered, with their kinds."""
    return [(one.kind, servo) for one in rounds for servo in one.found]
