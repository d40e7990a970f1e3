"""Choice of the turn that a position belongs to.

The encoder measures the position within one turn. A joint whose range is near the encoder's zero
can be on the other side of it, at 4090 instead of -6, and a servo that counts turns may have
counted some while torque was off. The joint gets the position nearest to its range. The servo
itself would move in the other direction, which must be prevented.
"""


def nearest_turn(steps: int, low: int, high: int, turn: int) -> int:
    """Return the position with whole turns added so that it is nearest to the range low..high."""
    if low <= steps <= high:
        return steps
    above = low + (steps - low) % turn
    below = above - turn
    if above <= high or above - high < low - below:
        return above
    if above - high > low - below:
        return below
    # Both are equally far: the servo's own count decides if it is one of them.
    return below if steps < low else above
