"""Time of each part of a bus cycle: python tests/bench/bench_bus_layers.py [--rounds 12]

Nine servos on a pseudo-terminal, without the bytes' time on the wire. Each row does what the one
above it does and a layer more, up to a whole cycle; the bare client and rustypot next to them. All
take turns in one run, and the least of the rounds is given. Looks inside the driver.
"""

import argparse
import time
from collections.abc import Sequence
from contextlib import ExitStack

from bench_bus_peers import emulated, in_turns, out
from bus_clients import IDS, Cycle, clients, driver, ours
from rich.table import Table

from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.sim_mock.pty.client import PtyBus

WAIT_S = 0.2
GOALS: Sequence[int] = [2048] * len(IDS)


def layers(bus: SmartServoBus) -> dict[str, Cycle]:
    """Return cycles, each a layer deeper than the one before; the bus is open, its torque on."""
    reader, line, port = bus._reader, bus._line, bus._port
    ids, turns = bus._poll_list.group, reader._together
    groups = [reader._group(ids, turns.next_window()) for _ in range(8)]
    groups = [group for group in groups if "acceleration" not in group.window.fields][:2]
    expected = bus._feedback._expected
    packet = bus._goals.packet(GOALS, bus._speeds)

    def port_alone(k: int) -> int:
        group = groups[k & 1]
        port.write(group.request)
        raw = port.read_until(group.reply_length, time.monotonic() + WAIT_S)
        port.write(packet)
        return len(IDS) * (len(raw) == group.reply_length)

    def cleared(k: int) -> int:
        group = groups[k & 1]
        raw, _ = port.exchange(group.request, group.reply_length, time.monotonic() + WAIT_S)
        port.write(packet)
        return len(IDS) * (len(raw) == group.reply_length)

    def exchange(k: int) -> int:
        group = groups[k & 1]
        raw, _ = line.exchange(group.request, group.reply_length)
        line.send(packet)
        return len(IDS) * (len(raw) == group.reply_length)

    def checked(k: int) -> int:
        group = groups[k & 1]
        raw, _ = line.exchange(group.request, group.reply_length)
        values = group.parse_whole(raw, expected)
        line.send(packet)
        return len(IDS) * (values is not None)

    def taken(k: int) -> int:
        feedback = bus.read(time.monotonic())
        line.send(packet)
        return len(IDS) - len(feedback.missing)

    def whole(k: int) -> int:
        feedback = bus.read(time.monotonic())
        bus.write([2048 + k % 8] * len(IDS))
        return len(IDS) - len(feedback.missing)

    return {
        "the port alone: write, poll, read, write": port_alone,
        "and look for what came before": cleared,
        "and time-outs, counts, starvation": exchange,
        "and all checks, one unpacking": checked,
        "and what is due, plausibility, units": taken,
        "and limits and packet of goals": whole,
    }


def main() -> None:
    """Measure, and print a table for each kind."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--cycles", type=int, default=200, help="in each round")
    args = parser.parse_args()
    for kind in ("dynamixel", "feetech"):
        with ExitStack() as stack:
            path = stack.enter_context(PtyBus()).start_device(emulated(kind, None))
            bus = driver(kind, BlockingPort(path), 1_000_000)
            bus.open()
            bus.enable_torque()
            cycles = layers(bus)
            for client in clients(kind):
                if client.name in ("bare", "rustypot"):
                    path = stack.enter_context(PtyBus()).start_device(emulated(kind, None))
                    with ours(kind, path, 1_000_000):  # sets the servos up
                        pass
                    cycles[client.name] = stack.enter_context(client.opened(path, 1_000_000))
            found = in_turns(cycles, args.rounds, args.cycles)
            bus.disable_torque()
            bus.close()
        table = Table("layer", "CPU us", "more than above", title=f"{kind}, {len(IDS)} servos")
        before = 0.0
        for name, rounds in found.items():
            least = min(spans.cpu_us for spans in rounds)
            more = f"{least - before:+.1f}" if name.startswith("and") else ""
            table.add_row(name, f"{least:.1f}", more)
            before = least
        out.print(table)


if __name__ == "__main__":
    main()
