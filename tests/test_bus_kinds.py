"""What every kind of servo bus promises, over both twins: one suite for all of them.

Kinds: Dynamixel, Feetech STS, hobby servos on a Maestro, and all three as one bus. Twins:
the emulated servos in this process, and behind a pseudo-terminal. What only one kind does
is in the tests of its own name.
"""

from math import nan

import pytest
from bus_kinds import BOARDS, GRAIN_STEPS, KINDS, PLACES, SHARES, Twin, in_process, twin_of
from hypothesis import given, settings
from hypothesis import strategies as st
from present import present
from servo_rows import rows

from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.drivers.servo_models import servo_label

TWINS = ("in-process", "pty")
AWAY = (0.2, 0.8, 0.3, 0.7, 0.25, 0.75)


@pytest.fixture(params=[(kind, place) for kind in KINDS for place in TWINS], ids="-".join)
def twin(request):
    with twin_of(*request.param) as made:
        yield made


@pytest.fixture(params=KINDS)
def here(request):
    """Return a twin in this process: for what takes long, or needs no terminal."""
    with twin_of(request.param, "in-process") as made:
        yield made


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


@pytest.fixture
def held(twin):
    yield from holding(twin)


@pytest.fixture
def held_here(here):
    yield from holding(here)


def starts(twin):
    return [SHARES[place % 4] for place in range(twin.count)]


def away(twin):
    return AWAY[: twin.count]


def smart(twin):
    """Return the places of servos that answer for themselves."""
    return [place for place, name in twin.on.items() if name not in BOARDS]


def well(readings):
    return all(r is not None and r.torque for r in readings)


# --- open, engage, read, write, release


def test_open_finds_all_and_nothing_moves(twin):
    twin.pulses_on()
    bus = twin.bus()
    before = twin.truth()
    bus.open()
    readings = rows(bus.read(twin.now_s()))
    assert twin.near(twin.seen(readings), starts(twin))
    # A Maestro that gives pulses goes on to give them; nobody else holds anything.
    assert [present(r).torque for r in readings] == [
        twin.on[p] in BOARDS for p in range(twin.count)
    ]
    bus.write(twin.steps(away(twin)))
    twin.run(bus, 0.1, away(twin))
    assert twin.near(twin.truth(), before)
    bus.close()


def test_readings_are_fresh_in_order_and_say_whether_they_are_measured(here, held_here):
    here.run(held_here, 0.05)
    before_s = here.now_s()
    readings = rows(held_here.read(before_s))
    assert here.near(here.seen(readings), starts(here))
    assert all(before_s <= present(r).at_s <= here.now_s() for r in readings)
    assert [present(r).measured for r in readings] == [
        here.on[p] not in BOARDS for p in range(here.count)
    ]
    assert not any(present(r).fault or present(r).rearmed for r in readings)


def test_engage_holds_every_servo_where_it_is(here):
    here.pulses_on()
    bus = here.bus()
    bus.open()
    before = here.truth()
    goals = bus.enable_torque()
    assert here.near(here.shares(goals), before)
    for _ in range(10):
        readings = here.run(bus, 0.02)
        assert here.near(here.truth(), before)
    assert well(readings)
    assert here.holding() == [True] * here.count
    bus.disable_torque()
    bus.close()


def test_who_cannot_tell_his_place_goes_to_his_rest_and_that_is_said(here):
    bus = here.bus()
    bus.open()
    before = here.truth()
    bus.enable_torque()
    hobby = [here.on[p] in BOARDS for p in range(here.count)]
    wanted = [0.5 if one else at for one, at in zip(hobby, before, strict=True)]
    here.run(bus, 0.3, wanted)
    assert here.near(here.truth(), wanted)
    told = bus.events()
    limp = [line for line in told if "had no pulses: they go to their places at once" in line]
    assert len(limp) == any(hobby)
    for place, setup in enumerate(here.setups):
        assert not any(hobby) or hobby[place] == (servo_label(setup) in limp[0])
    bus.disable_torque()
    bus.close()


def test_goals_are_followed_and_told(twin, held):
    readings = twin.until(
        held, lambda r: twin.near(twin.seen(r), away(twin)), away(twin), patience_s=5.0
    )
    twin.run(held, 0.3, away(twin))
    assert twin.near(twin.truth(), away(twin))
    assert well(readings)


def test_goals_are_clipped_to_the_limits(here, held_here):
    ends = [(-40.0, 60.0, -1e-3, 1.001)[place % 4] for place in range(here.count)]
    inside = [min(1.0, max(0.0, end)) for end in ends]
    here.until(held_here, lambda r: here.near(here.seen(r), inside), ends, patience_s=5.0)
    here.run(held_here, 0.3, ends)
    assert here.near(here.truth(), inside)
    for place, (goal, wanted) in enumerate(zip(here.goals(), here.steps(inside), strict=True)):
        assert abs(goal - wanted) <= GRAIN_STEPS.get(here.on[place], 0)


def test_what_is_no_number_is_refused_and_nothing_is_sent(here, held_here):
    here.run(held_here, 0.05, starts(here))
    before = held_here.health().tx_bytes
    for place in range(here.count):
        goals = here.steps(away(here))
        goals[place] = nan
        with pytest.raises(ValueError, match="not a number"):
            held_here.write(goals)
    for wrong in (goals[:-1], [*goals, goals[0]]):
        with pytest.raises(ValueError):
            held_here.write(wrong)
    assert held_here.health().tx_bytes == before
    here.run(held_here, 0.2)
    assert here.near(here.truth(), starts(here))


def test_release_takes_the_torque_of_all_and_is_confirmed(twin, held):
    twin.run(held, 0.05)
    assert all(twin.holding())
    held.disable_torque()
    assert twin.holding() == [False] * twin.count
    readings = twin.run(held, 0.1, away(twin))
    assert not any(r.torque for r in readings)
    assert twin.near(twin.truth(), starts(twin))
    assert "refused" not in held.health().errors
    assert held.events() == ()


def test_a_bus_is_opened_again_and_closed_twice(here):
    bus = here.bus()
    for _ in range(2):
        here.pulses_on()
        bus.open()
        bus.enable_torque()
        assert here.near(here.seen(rows(bus.read(here.now_s()))), starts(here))
        bus.disable_torque()
        bus.close()
        bus.close()


def test_bytes_are_counted_and_no_errors(here, held_here):
    before = held_here.health()
    here.run(held_here, 0.1, starts(here))
    after = held_here.health()
    assert after.tx_bytes > before.tx_bytes > 0
    assert after.rx_bytes > before.rx_bytes > 0
    assert after.errors == {}
    assert held_here.faults() == ()


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
    assert any("restarted: set up anew" in line for line in told), told
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


# --- other limits


def test_retune_waits_for_the_next_torque(here):
    here.pulses_on()
    bus = here.bus()
    bus.open()
    bus.enable_torque()
    narrow = [
        s._replace(min_steps=at - 40, max_steps=at + 40)
        for s, at in zip(here.setups, here.steps([0.5] * here.count), strict=True)
    ]
    bus.retune(narrow)
    here.run(bus, 1.5, away(here))
    assert here.near(here.truth(), away(here))
    bus.disable_torque()
    goals = bus.enable_torque()
    for setup, goal in zip(narrow, goals, strict=True):
        assert setup.min_steps <= goal <= setup.max_steps
    here.run(bus, 1.0, away(here))
    for setup, goal in zip(narrow, here.goals(), strict=True):
        assert setup.min_steps <= goal <= setup.max_steps
    with pytest.raises(ValueError, match="other servos need another bus"):
        bus.retune([s._replace(id=s.id + 1) for s in narrow])
    with pytest.raises(ValueError, match="other servos need another bus"):
        bus.retune(narrow[:-1])


# --- properties


@pytest.mark.parametrize("kind", ["dynamixel", "feetech"])
def test_a_goal_between_two_steps_is_rounded(kind):
    twin = Twin(kind, in_process(kind).wires, patient=False)
    twin.pulses_on()
    bus = twin.bus()
    bus.open()
    bus.enable_torque()
    bus.read(twin.now_s())
    middle = [(setup.min_steps + setup.max_steps) // 2 for setup in twin.setups]
    bus.write([steps + 0.4 for steps in middle])  # type: ignore[misc]
    twin.wait(0.02)
    assert list(twin.goals()) == middle


ANY = st.integers(-(2**40), 2**40) | st.floats(allow_nan=True, allow_infinity=True)
FAULTS = ("", "lose all count 2", "delay all 15 count 3", "corrupt all count 3", "unplug for 0.05")


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=12, deadline=None)
@given(data=st.data())
def test_no_goal_outside_the_limits_ever_reaches_a_servo(kind, data):
    inside = in_process(kind)
    twin = Twin(kind, inside.wires, patient=False)
    twin.pulses_on()
    bus = twin.bus()
    bus.open()
    bus.enable_torque()
    rows = data.draw(st.lists(st.lists(ANY, min_size=twin.count, max_size=twin.count), max_size=6))
    twin.command(data.draw(st.sampled_from(FAULTS)) or "clear")
    for goals in rows:
        bus.read(twin.now_s())
        before = len(inside.sent)
        try:
            bus.write(goals)
        except ValueError:
            assert any(goal != goal for goal in goals)
            assert len(inside.sent) == before
        for setup, goal in zip(twin.setups, twin.goals(), strict=True):
            assert goal is None or setup.min_steps <= goal <= setup.max_steps
        twin.wait(0.02)
    # Nothing stands beyond but for what a servo's own inertia does.
    assert all(-0.02 <= share <= 1.02 for share in twin.truth())
