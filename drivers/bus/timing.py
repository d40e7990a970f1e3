"""Times of every kind of bus."""

from typing import NamedTuple


class BusTiming(NamedTuple):
    """Times of a bus, seconds.

    reply_timeout_s: longest time-out of an answer, added to the transmission time of its bytes
    give_up_s: a run ends when the port, or all servos, have been lost for this long
    stagger_s: delay between the first pulses of one hobby servo and of the next; all at once could
        overload a weak power supply
    """

    reply_timeout_s: float = 0.02
    give_up_s: float = 60.0
    stagger_s: float = 0.1


TIMING = BusTiming()
