"""Which turn a position belongs to. Numbers in, numbers out.

The encoder knows its place within one turn; a joint whose range lies near the encoder's
zero can stand on the other side of it, at 4090 where -6 is meant, and a servo that counts
turns may have counted some while the torque was off. What the joint is told is the place
nearest to its range. The servo itself would go the other way round: it must not.
"""


def nearest_turn(steps: int, low: int, high: int, turn: int) -> int:
    """Return the position, whole turns added, that lies nearest to the range low..high."""
    if low <= steps <= high:
        return steps
    above = low + (steps - low) % turn
    below = above - turn
    if above <= high or above - high < low - below:
        return above
    if above - high > low - below:
        return below
    # Both ways are as long: as the servo has it where it is one of them.
    return below if steps < low else above
