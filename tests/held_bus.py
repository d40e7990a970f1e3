"""A bus of any kind that holds its servos, and goals for them."""

from bus_kinds import SHARES

TWINS = ("in-process", "pty")


AWAY = (0.2, 0.8, 0.3, 0.7, 0.25, 0.75)


def holding(twin):
    """Return a bus that holds every servo where it stands."""
    twin.pulses_on()
    bus = twin.bus()
    bus.open()
    bus.enable_torque()
    bus.events()
    yield bus
    bus.disable_torque()
    bus.close()


def starts(twin):
    return [SHARES[place % 4] for place in range(twin.count)]


def away(twin):
    return AWAY[: twin.count]


def well(readings):
    return all(r is not None and r.torque for r in readings)
