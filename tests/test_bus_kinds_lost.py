"""What every kind of servo bus does when a servo, a port or a supply goes away, over both twins."""

import pytest
from bus_kinds import BOARDS, KINDS, PLACES, twin_of
from held_bus import TWINS, away, holding, starts, well
from servo_rows import rows

from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.servo_models import servo_label


@pytest.fixture(params=[(kind, place) for kind in KINDS for place in TWINS], ids="-".join)
def twin(request):
    with twin_of(*request.param) as made:
        yield made


@pytest.fixture(params=KINDS)
def here(request):
    """Return a twin in this process: for what takes long, or needs no terminal."""
    with twin_of(request.param, "in-process") as made:
        yield made


@pytest.fixture
def held(twin):
    yield from holding(twin)


@pytest.fixture
def held_here(here):
    yield from holding(here)


def smart(twin):
    """Return the places of servos that answer for themselves."""
    return [place for place, name in twin.on.items() if name not in BOARDS]


# --- somebody is missing


def test_open_names_who_is_missing_and_leaves_the_ports_free(twin):
    place = smart(twin)[-1] if smart(twin) else None
    if place is None:
        maestro = twin.on[0] == "maestro"
        twin.command("set mode mute" if maestro else "absent on")
        told = "no Maestro answers" if maestro else "no PCA9685 answers at 0x40"
        wanted = twin.setups
    else:
        told = rf"{twin.setups[place].name} \((servo|channel) 99\) does not answer"
        lost = twin.setups[place]._replace(id=99)
        wanted = [*twin.setups[:place], lost, *twin.setups[place + 1 :]]
    with pytest.raises(ServoMissing, match=told) as caught:
        twin.bus(wanted).open()
    message = str(caught.value)
    assert twin.wires.ports[twin.on[place or 0]].port_name in message
    assert "\n" not in message
    if place is None:
        twin.command("set mode usb-dual-port" if maestro else "absent off")
    bus = twin.bus()
    bus.open()
    bus.close()


def test_a_port_that_cannot_be_opened_is_named(here):
    for name in here.buses:
        here.command("deny on", name)
        with pytest.raises(PortError, match=f"emulated {name}"):
            here.bus().open()
        here.command("deny off", name)
    bus = here.bus()
    bus.open()
    bus.close()


def test_one_silent_servo_costs_only_itself(here, held_here):
    """A Maestro answers for all its channels at once: there the board is one."""
    if not smart(here):
        return
    place = smart(here)[0]
    others = [p for p in range(here.count) if p != place]
    here.strike("lose", place)
    readings = here.until(held_here, lambda r: r[place] is None, starts(here))
    for _ in range(20):
        readings = here.run(held_here, 0.0, starts(here))
        assert all(readings[p] is not None for p in others)
        here.wait(0.01)
    assert readings[place] is None
    assert held_here.health().errors["timeout"] >= 1
    here.until(held_here, lambda r: _says(held_here, here, place, "does not answer"), starts(here))
    here.command("clear", here.on[place])
    here.until(held_here, well, starts(here))
    assert here.near(here.truth(), starts(here))


def _says(bus, twin, place, what):
    """Return whether the bus says something of a servo by its joint's name."""
    who = servo_label(twin.setups[place])
    return any(line.startswith(who) and what in line for line in bus.events())


# --- a port goes away


def test_an_unplugged_port_comes_back_and_holds(twin, held):
    name = next(iter(twin.buses))
    gone = twin.buses[name]
    rest = [p for p in range(twin.count) if p not in gone]
    twin.run(held, 0.1, starts(twin))
    twin.command("unplug", name)
    twin.until(held, lambda r: all(r[p] is None for p in gone), starts(twin))
    for _ in range(20):
        # Who plans goals goes on for a while as if nothing were.
        readings = twin.run(held, 0.0, [0.5] * twin.count)
        assert [readings[p] for p in gone] == [None] * len(gone)
        assert all(readings[p] is not None for p in rest)
        twin.wait(0.01)
    twin.command("plug", name)
    rearmed = _until_back(twin, held, gone)
    assert sorted(rearmed) == sorted(gone)
    assert twin.near([twin.truth()[p] for p in gone], [starts(twin)[p] for p in gone])
    told = held.events()
    assert any(line.startswith("port lost: ") for line in told)
    assert any(line.startswith("port back after ") for line in told)


def _until_back(twin, bus, gone):
    """Tick until all hold again, with goals far away until a servo says where it begins."""
    goals, rearmed = [0.9] * twin.count, []
    before = twin.truth()

    def note(readings):
        for place, reading in enumerate(readings):
            if reading is not None and reading.rearmed:
                rearmed.append(place)
                goals[place] = twin.seen(readings)[place]
        return len(set(rearmed)) == len(gone) and well(readings)

    end_s = twin.now_s() + 8.0
    while not note(rows(bus.read(twin.now_s()))):
        assert twin.now_s() < end_s, (rearmed, bus.events())
        truth = twin.truth()
        assert twin.near([truth[p] for p in gone], [before[p] for p in gone])
        bus.write(twin.steps(goals))
        twin.wait(0.01)
    twin.run(bus, 0.3, goals)
    return rearmed


@pytest.mark.parametrize(("kind", "name"), [(k, name) for k in KINDS for name in PLACES[k]])
def test_a_port_that_stays_away_is_given_up_and_told_at_release(kind, name):
    with twin_of(kind, "in-process") as here:
        _given_up(here, name)


def _given_up(here, name):
    here.pulses_on()
    bus = here.bus(give_up_s=1.0)
    bus.open()
    bus.enable_torque()
    here.command("unplug", name)
    began_s = here.now_s()
    with pytest.raises(BusLost, match=f"emulated {name} has been gone for 1.[012] s"):
        here.run(bus, 3.0, starts(here))
    assert here.now_s() - began_s < 1.3
    with pytest.raises(BusLost, match=f"emulated {name} is gone.*cut the servo power"):
        bus.disable_torque()
    # What could be reached was let go of all the same.
    assert [on for p, on in enumerate(here.holding()) if here.on[p] != name] == [False] * (
        here.count - len(here.buses[name])
    )
    here.command("plug", name)
    bus.disable_torque()
    assert not any(here.holding())
    bus.close()


def test_no_read_takes_long_while_nobody_answers(here):
    here.pulses_on()
    bus = here.bus(give_up_s=2.0)
    bus.open()
    bus.enable_torque()
    here.run(bus, 0.5, starts(here))
    here.command("lose all")
    spent = []
    with pytest.raises(BusLost, match="answered for 2"):
        for _ in range(1000):
            began_s = here.now_s()
            bus.read(began_s)
            spent.append(here.now_s() - began_s)
            bus.write(here.steps(starts(here)))
            here.wait(0.01)
    assert max(spent) < 0.1


# --- a servo restarts


def test_a_restart_is_found_and_the_servo_held_where_it_is(here, held_here):
    place = 0
    # The board of a Maestro is one: all its channels restart.
    struck = [p for p in range(here.count) if here.on[p] in BOARDS]
    struck = struck if here.on[place] in BOARDS else [place]
    here.run(held_here, 0.2, starts(here))
    here.strike("brown-out", place)
    rearmed = _until_back(here, held_here, struck)
    assert sorted(rearmed) == struck
    assert all(here.holding())
    told = held_here.events()
    assert any("restarted: set up again" in line for line in told), told
    assert held_here.faults() == ()
    # It follows again, with the speed that it was set up with.
    here.until(held_here, lambda r: here.near(here.seen(r), away(here)), away(here))


@pytest.mark.parametrize("befalls", ["", "brown-out", "power cut", "unplug"])
def test_no_servo_is_faster_than_it_was_set_up_whatever_it_went_through(here, befalls):
    """A goal far away at once: only what the servo or its board has armed holds it back."""
    here.pulses_on()
    slow = [s._replace(max_speed_steps_s=0.2 * s.max_speed_steps_s) for s in here.setups]
    bus = here.bus(slow)
    bus.open()
    bus.enable_torque()
    here.run(bus, 0.3, starts(here))
    _befall(here, bus, befalls)
    before_s, before = here.now_s(), here.steps(here.truth())
    for _ in range(30):
        here.run(bus, 0.0, [0.95] * here.count)
        here.wait(0.02)
        now_s, now = here.now_s(), here.steps(here.truth())
        for setup, was, is_now in zip(slow, before, now, strict=True):
            most = 1.2 * setup.max_speed_steps_s * (now_s - before_s) + 12.0
            assert abs(is_now - was) <= most, (setup.name, is_now - was, most)
        before_s, before = now_s, now
    here.until(bus, lambda r: here.near(here.seen(r), [0.95] * here.count), [0.95] * here.count)


def _befall(here, bus, what):
    """Let something pass over all servos while they hold, until all hold again."""
    if what == "unplug":
        here.command("unplug for 0.2")
    elif what:
        if what == "power cut":
            here.command("lose all for 1")
        for place in range(here.count):
            if here.on[place] not in BOARDS or place == min(here.buses[here.on[place]]):
                here.strike("brown-out", place)
    if what:
        here.until(bus, lambda r: None in r, starts(here))
        here.until(bus, well, starts(here))
        bus.events()


def test_a_fault_is_named_with_its_joint_or_board(here):
    here.pulses_on()
    bus = here.bus()
    bus.open()
    bus.enable_torque()
    here.run(bus, 0.5, starts(here))
    bus.events()
    for name, places in here.buses.items():
        if name == "pca9685":
            # It finds no errors; that it restarts again and again is a fault of its channels.
            for _ in range(4):
                here.command("brown-out", name)
                here.run(bus, 0.3, starts(here))
            assert here.run(bus, 0.1)[places[1]].fault.startswith("restarts again and again")
            assert f"{servo_label(here.setups[places[1]])}: restarts again" in " ".join(
                bus.faults()
            )
            continue
        if name == "maestro":
            here.command("error protocol", name)
            cause = "board 12: serial protocol error"
        else:
            here.strike("overload", places[1])
            setup = here.setups[places[1]]
            cause = f"{servo_label(setup)}: overload"
        readings = here.run(bus, 0.3, starts(here))
        assert any(fault.startswith(cause) for fault in bus.faults()), bus.faults()
        assert any(cause.split(": ")[1] in line for line in bus.events())
        assert None not in readings
        if name not in BOARDS:
            assert readings[places[1]].fault == "overload"
    bus.disable_torque()
    bus.close()
