"""Test suite for every kind of servo bus: lost servos, ports and supplies."""

import pytest

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.errors import BusLost, PortError, ServoMissing
from gazerig.testing.bus_bench import are_healthy, rows
from gazerig.testing.bus_suite import BusBenches


class BusLossSuite(BusBenches):
    """Servos and ports that are absent, fall silent, restart or fail, and recover."""

    # --- absent servos

    def test_open_names_who_is_missing_and_leaves_the_ports_free(self, twin):
        place = twin.smart_indices()[-1] if twin.smart_indices() else None
        kind = twin.kinds[twin.on[place or 0]]
        wanted = list(twin.setups)
        if place is None:
            twin.command(kind.absence.begin)
            told = kind.absence.message_pattern
        else:
            told = rf"{twin.setups[place].name} \((servo|channel) 99\) does not answer"
            wanted[place] = twin.setups[place]._replace(id=99)
        with pytest.raises(ServoMissing, match=told) as caught:
            twin.bus(wanted).open()
        message = str(caught.value)
        assert twin.wires.ports[kind.name].port_name in message
        assert "\n" not in message
        if place is None:
            twin.command(kind.absence.end)
        bus = twin.bus()
        bus.open()
        bus.close()

    def test_a_port_that_cannot_be_opened_is_named(self, here):
        for name in here.buses:
            here.command("deny on", name)
            with pytest.raises(PortError, match=f"emulated {name}"):
                here.bus().open()
            here.command("deny off", name)
        bus = here.bus()
        bus.open()
        bus.close()

    def test_one_silent_servo_costs_only_itself(self, here, held_here):
        """A Maestro answers for all its channels, so the whole board counts as one servo."""
        if not here.smart_indices():
            return
        place = here.smart_indices()[0]
        others = [p for p in range(here.count) if p != place]
        here.apply_fault("lose", place)
        readings = here.run_until(held_here, lambda r: r[place] is None, here.start_shares())
        for _ in range(20):
            readings = here.run(held_here, 0.0, here.start_shares())
            assert all(readings[p] is not None for p in others)
            here.wait(0.01)
        assert readings[place] is None
        assert held_here.health().errors["timeout"] >= 1
        here.run_until(
            held_here,
            lambda r: _reports(held_here, here, place, "does not answer"),
            here.start_shares(),
        )
        here.command("clear", here.on[place])
        here.run_until(held_here, are_healthy, here.start_shares())
        assert here.are_near(here.true_shares(), here.start_shares())

    # --- loss of a port

    def test_an_unplugged_port_comes_back_and_holds(self, twin, held):
        name = next(iter(twin.buses))
        gone = twin.buses[name]
        rest = [p for p in range(twin.count) if p not in gone]
        twin.run(held, 0.1, twin.start_shares())
        twin.command("unplug", name)
        twin.run_until(held, lambda r: all(r[p] is None for p in gone), twin.start_shares())
        for _ in range(20):
            # A planner continues to send goals for a while.
            readings = twin.run(held, 0.0, [0.5] * twin.count)
            assert [readings[p] for p in gone] == [None] * len(gone)
            assert all(readings[p] is not None for p in rest)
            twin.wait(0.01)
        twin.command("plug", name)
        rearmed = _run_until_recovered(twin, held, gone)
        assert sorted(rearmed) == sorted(gone)
        assert twin.are_near(
            [twin.true_shares()[p] for p in gone], [twin.start_shares()[p] for p in gone]
        )
        told = held.events()
        assert any(line.startswith("port lost: ") for line in told)
        assert any(line.startswith("port back after ") for line in told)

    def test_a_port_that_stays_away_is_given_up_and_told_at_release(self, another):
        for name in another().bench.buses:
            here = another().bench
            here.pulses_on()
            bus = here.bus(give_up_s=1.0)
            bus.open()
            bus.enable_torque()
            here.command("unplug", name)
            began_s = here.now_s()
            with pytest.raises(BusLost, match=f"emulated {name} has been gone for 1.[012] s"):
                here.run(bus, 3.0, here.start_shares())
            assert here.now_s() - began_s < 1.3
            with pytest.raises(BusLost, match=f"emulated {name} is gone.*cut the servo power"):
                bus.disable_torque()
            # The servos that could be reached were released nevertheless.
            assert [on for p, on in enumerate(here.holding()) if here.on[p] != name] == [False] * (
                here.count - len(here.buses[name])
            )
            here.command("plug", name)
            bus.disable_torque()
            assert not any(here.holding())
            bus.close()

    def test_no_read_takes_long_while_nobody_answers(self, here):
        here.pulses_on()
        bus = here.bus(give_up_s=2.0)
        bus.open()
        bus.enable_torque()
        here.run(bus, 0.5, here.start_shares())
        here.command("lose all")
        spent = []
        with pytest.raises(BusLost, match="answered for 2"):
            for _ in range(1000):
                began_s = here.now_s()
                bus.read(began_s)
                spent.append(here.now_s() - began_s)
                bus.write(here.steps(here.start_shares()))
                here.wait(0.01)
        assert max(spent) < 0.1

    # --- a servo restarts

    def test_a_restart_is_found_and_the_servo_held_where_it_is(self, here, held_here):
        place = 0
        # A Maestro restarts as a whole, so all its channels restart.
        struck = [p for p in range(here.count) if here.is_board(p)]
        struck = struck if here.is_board(place) else [place]
        here.run(held_here, 0.2, here.start_shares())
        here.apply_fault("brown-out", place)
        rearmed = _run_until_recovered(here, held_here, struck)
        assert sorted(rearmed) == struck
        assert all(here.holding())
        told = held_here.events()
        assert any("restarted: set up again" in line for line in told), told
        assert held_here.faults() == ()
        # It follows again, at the speed that was set at the start.
        here.run_until(
            held_here,
            lambda r: here.are_near(here.measured_shares(r), here.away_shares()),
            here.away_shares(),
        )

    @pytest.mark.parametrize("befalls", ["", "brown-out", "power cut", "unplug"])
    def test_no_servo_is_faster_than_it_was_set_up_whatever_it_went_through(self, here, befalls):
        """Only the limit of the servo or its board restrains a goal that is suddenly far away."""
        here.pulses_on()
        slow = [s._replace(max_speed_steps_s=0.2 * s.max_speed_steps_s) for s in here.setups]
        bus = here.bus(slow)
        bus.open()
        bus.enable_torque()
        here.run(bus, 0.3, here.start_shares())
        if befalls == "unplug":
            here.command("unplug for 0.2")
        elif befalls:
            if befalls == "power cut":
                here.command("lose all for 1")
            for place in range(here.count):
                if not here.is_board(place) or place == min(here.buses[here.on[place]]):
                    here.apply_fault("brown-out", place)
        if befalls:
            here.run_until(
                bus, lambda r: None in r or any(row.rearmed for row in r), here.start_shares()
            )
            here.run_until(bus, are_healthy, here.start_shares())
            bus.events()
        before_s, before = here.now_s(), here.steps(here.true_shares())
        for _ in range(30):
            here.run(bus, 0.0, [0.95] * here.count)
            here.wait(0.02)
            now_s, now = here.now_s(), here.steps(here.true_shares())
            for setup, was, is_now in zip(slow, before, now, strict=True):
                most = 1.2 * setup.max_speed_steps_s * (now_s - before_s) + 12.0
                assert abs(is_now - was) <= most, (setup.name, is_now - was, most)
            before_s, before = now_s, now
        here.run_until(
            bus,
            lambda r: here.are_near(here.measured_shares(r), [0.95] * here.count),
            [0.95] * here.count,
        )

    def test_a_fault_is_named_with_its_joint_or_board(self, here):
        here.pulses_on()
        bus = here.bus()
        bus.open()
        bus.enable_torque()
        here.run(bus, 0.5, here.start_shares())
        bus.events()
        for name, places in here.buses.items():
            fault = here.kinds[name].fault
            if fault is None:
                continue
            setup = here.setups[places[1]]
            for _ in range(fault.times):
                here.command(fault.command.format(id=setup.id), name)
                readings = here.run(bus, 0.3, here.start_shares())
            whose = fault.board or servo_label(setup)
            assert any(one.startswith(f"{whose}: {fault.cause_text}") for one in bus.faults()), (
                bus.faults()
            )
            assert fault.times > 1 or any(fault.cause_text in line for line in bus.events())
            assert fault.times > 1 or None not in readings
            if not here.kinds[name].board:
                assert readings[places[1]].fault == fault.cause_text
            elif not fault.board:
                assert here.run(bus, 0.1)[places[1]].fault.startswith(fault.cause_text)
        bus.disable_torque()
        bus.close()


def _reports(bus, twin, place, what):
    """Return whether the bus reports an event of a servo under its joint's name."""
    who = servo_label(twin.setups[place])
    return any(line.startswith(who) and what in line for line in bus.events())


def _run_until_recovered(twin, bus, gone):
    """Tick until all hold again, with distant goals until a servo reports its position."""
    goals, rearmed = [0.9] * twin.count, []
    before = twin.true_shares()

    def note(readings):
        for place, reading in enumerate(readings):
            if reading is not None and reading.rearmed:
                rearmed.append(place)
                goals[place] = twin.measured_shares(readings)[place]
        return len(set(rearmed)) == len(gone) and are_healthy(readings)

    end_s = twin.now_s() + 8.0
    while not note(rows(bus.read(twin.now_s()))):
        assert twin.now_s() < end_s, (rearmed, bus.events())
        truth = twin.true_shares()
        assert twin.are_near([truth[p] for p in gone], [before[p] for p in gone])
        bus.write(twin.steps(goals))
        twin.wait(0.01)
    twin.run(bus, 0.3, goals)
    return rearmed
