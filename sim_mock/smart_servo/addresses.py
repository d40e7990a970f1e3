"""Servos at a client's baud rate, by id: shared ids, secondary ids, baud rates."""

from collections.abc import Iterable
from typing import Generic, TypeVar

from gazerig.sim_mock.smart_servo.servo import EmulatedServo

S = TypeVar("S", bound=EmulatedServo)


class AddressTable(Generic[S]):
    """The servos that receive one client's bytes.

    by_id: the first servo of each id; twins: further ones with the same id
    shadows: servos by secondary id: they obey and never answer
    delay_s: return delay by id
    """

    def __init__(self, servos: Iterable[S], client_baud: int | None) -> None:
        self.by_id: dict[int, S] = {}
        self.twins: dict[int, list[S]] = {}
        self.shadows: dict[int, list[S]] = {}
        self.delay_s: dict[int, float] = {}
        for servo in servos:
            if at_baud(servo, client_baud):
                if servo.id in self.by_id:
                    self.twins.setdefault(servo.id, []).append(servo)
                else:
                    self.by_id[servo.id] = servo
                    self.delay_s[servo.id] = servo.return_delay_s
                shadow = servo.shadow_id
                if shadow is not None and shadow != servo.id:
                    self.shadows.setdefault(shadow, []).append(servo)

    def all_servos(self) -> list[S]:
        """Return all servos at the client's baud rate."""
        return [*self.by_id.values(), *(twin for pair in self.twins.values() for twin in pair)]


def at_baud(servo: EmulatedServo, client_baud: int | None) -> bool:
    """Return whether a servo and a client at this baud rate (None: any) understand each other."""
    return client_baud is None or servo.baud == client_baud
