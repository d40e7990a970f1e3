"""What every kind of servo bus promises, over both twins: one suite for all of them.

Kinds: Dynamixel, Feetech STS, hobby servos on a Maestro, and all three as one bus. Twins:
the emulated servos in this process, and behind a pseudo-terminal. What only one kind does
is in the tests of its own name.
"""

from math import nan

import pytest
from bus_kinds import BOARDS, GRAIN_STEPS, KINDS, Twin, in_process, twin_of
from held_bus import TWINS, away, holding, starts, well
from hypothesis import given, settings
from hypothesis import strategies as st
from present import present
from servo_rows import rows

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
