"""Every byte of each kind of bus, with its time, and what the driver makes of it, as reviewed once.

Servos rest, move, and meet every fault, on a line with the times of 1 Mbit/s. A digest stands for
all that passed in a step, to the microsecond; events and faults are written out. Run as a program
with tests/helpers in PYTHONPATH this file prints all of it, to be compared with that of another
commit; with ``--write`` it writes tests/golden/bus_transcript.txt anew.
"""

import sys
from pathlib import Path
from zlib import crc32

import pytest
from bus_kinds import BOARDS, KINDS, TICK_S, in_process

from gazerig.drivers.errors import DriverError

GOLDEN = Path(__file__).parents[3] / "golden" / "bus_transcript.txt"

SMART = """0.5 2
0.35 3 hold
0.45 6
0.45 20 lose {b} count 3
0.45 6 lose all for 0.07
0.45 20 corrupt {b} 41 count 2
0.45 4 truncate {c} 7 count 2
0.45 8 delay {b} 9 count 3
0.45 3 echo
0.45 50 brown-out {a}
0.6 4 pause 0.5
0.6 0 lose {b} for 0.6
0.6 12 pause 0.5
0.6 25 overload {c}
0.6 5 temperature {a} 90
0.6 60 temperature {a} 40
0.6 9 turn {b} 300
0.5 4 stick {d}
0.6 4 free {d}
0.6 20 unplug for 0.1
0.6 30 pause 0.5
0.6 2 brown-out {d}
0.6 2 turn {d} -1500
0.6 20 pause 1
0.6 2 brown-out {b}
0.6 9 pause 4
0.6 2 brown-out {b}
0.6 9 pause 4
0.6 2 brown-out {b}
0.6 9 pause 4
0.6 2 brown-out {b}
0.6 9 pause 1
0.6 2 brown-out {b}
0.6 9 pause 1
0.6 2 brown-out {b}
0.6 9 pause 1
0.6 2 unplug for 0.015
0.6 9 release
0.6 0 unplug for 0.005
0.6 30 hold
0.6 9 narrow
0.6 2 brown-out {a}
0.6 2 brown-out {c}
0.6 2 pause 1
0.6 20 hold
0.6 2 voltage {a} 3
0.6 2 release"""
"""Goals as shares of the range, ticks, and the command that comes before them."""

BOARD = """0.5 2
0.35 3 hold
0.6 20
0.6 8 lose all count 3
0.6 8 corrupt all 9 count 3
0.6 8 truncate all 1 count 3
0.6 8 delay all 25 count 3
0.45 4 stick {b}
0.6 4 free {b}
0.6 4 turn {b} 100
0.6 30 brown-out
0.6 20 unplug for 0.1
0.6 20 pause 0.5
0.6 2 unplug for 0.015
0.6 9 release
0.6 0 unplug for 0.005
0.6 30 hold
0.6 30 narrow
0.6 8 lose-writes 2
0.6 2 release"""


def transcript(name):
    """Yield the title of each step and all that passes in it, each with its time."""
    bench, noted = in_process(name, wire_time=True), []
    port, write, read, bus = bench.port, bench.port.write, bench.port.read_until, bench.bus()

    def note(mark, text):
        noted.append(f"{1000.0 * bench.now_s():.3f} {mark} {text}")

    def noted_write(data):
        note(">", data.hex())
        write(data)

    def noted_read(length, deadline_s):
        raw = read(length, deadline_s)
        note("<", raw.hex())
        return raw

    def attempt(step):
        try:
            note("=", step())
        except DriverError as error:
            note("!", error)
        for line in (*bus.events(), *bus.faults()):
            note("-", line)

    def tick():
        feedback = bus.read(bench.now_s())
        bus.write(goals)
        return f"{feedback} truly at {[round(place, 1) for place in bench.places()]}"

    port.write, port.read_until = noted_write, noted_read  # type: ignore[method-assign]
    port.closePort = lambda: note("closed", "")  # type: ignore[method-assign]
    ids = dict(zip("abcd", (setup.id for setup in bench.setups), strict=True))
    bench.command("lose all")
    attempt(bus.open)
    bench.command("clear")
    attempt(bus.open)
    yield "open", noted
    for line in (BOARD if name in BOARDS else SMART).splitlines():
        share, ticks, *words = line.split(" ", 2)
        command, goals = "".join(words).format(**ids), bench.steps([float(share)] * 4)
        noted = []
        if command == "narrow":
            low, high = bench.steps([0.5, 0.55])
            inner = [
                s._replace(
                    min_steps=low,
                    max_steps=high,
                    gains=(30, 2, 20),
                    strength=0.5,
                    max_accel_steps_s2=9e3,
                )
                for s in bench.setups
            ]
            bus.retune(inner)  # type: ignore[attr-defined]
        if command in ("hold", "narrow"):
            attempt(bus.enable_torque)
        elif command == "release":
            attempt(bus.disable_torque)
        elif command.startswith("pause"):
            bench.wait(float(command[6:]))
        elif command:
            bench.command(command)
        for _ in range(int(ticks)):
            attempt(tick)
            bench.wait(TICK_S)
        yield line, noted
    yield str(bus.health()), []


def summary(name):
    """Return a line for each step, and those for people."""
    lines = [name]
    for title, noted in transcript(name):
        lines.append(f"{title}: {len(noted)} lines, {crc32(repr(noted).encode()):08x}")
        told = dict.fromkeys(line.partition(" ")[2] for line in noted)
        lines += [line for line in told if line[0] in "-!"]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", KINDS)
def test_what_passes_on_the_line_is_what_was_reviewed(name):
    assert summary(name) in GOLDEN.read_text(encoding="utf-8")


if __name__ == "__main__":
    if "--write" in sys.argv:
        GOLDEN.write_text("".join(map(summary, KINDS)), encoding="utf-8")
    for kind in KINDS:
        for heading, passed in transcript(kind):
            print(kind, heading, *passed, sep="\n")
