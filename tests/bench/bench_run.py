"""What the whole chain costs: python tests/bench/bench_run.py [--seconds 60]

One run prints the control loop's rate and jitter on the pseudo-terminal, processor time
and memory, simulated seconds per wall second, the time of each stage of a tick, and the
bus exchange beside the vendor's SDK on the same emulated servos. Nothing here passes or
fails: machines differ and are shared, so compare figures of one run with each other.
"""

import argparse
import os
import resource
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from dynamixel_sdk import GroupSyncRead, GroupSyncWrite, PacketHandler
from fastcrc import crc16

from gazerig.config.schema import load_rig
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.robot.analysis.summary import Summary
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run
from gazerig.robot.model.types import in_order
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort


def main() -> None:
    """Run all parts and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    seconds = parser.parse_args().seconds
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start\n")
    real_time_loop(seconds)
    simulated_speed()
    stages()
    bus_exchange()


def real_time_loop(seconds: float) -> None:
    """Measure rate and jitter at 200 Hz on the pseudo-terminal, without a page."""
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=False, seed=0, scene="visitor"))
    summary, starts = Summary(), []
    began_cpu = time.process_time()
    made.robot.start(made.clock)
    began = time.monotonic()

    def watch(tick: Any) -> None:
        starts.append(tick.t_s)
        summary.update(tick)

    count = run(
        made.robot,
        made.clock,
        made.loop,
        lambda s: "seconds" if s >= seconds else None,
        watch,
    )
    wall, cpu = time.monotonic() - began, time.process_time() - began_cpu
    made.robot.stop()
    made.close()
    times = np.array(starts)
    period = 1.0 / made.loop.rate_hz
    off = (times - times[0]) % period
    off = np.minimum(off, period - off) * 1e3
    steps = np.diff(times)
    print(f"control loop, {seconds:.0f} s at {made.loop.rate_hz:.0f} Hz on a pseudo-terminal")
    print(f"  mean rate       {len(steps) / (times[-1] - times[0]):.3f} Hz, {count.ticks} ticks")
    print(f"  overruns        {count.overruns} slots skipped")
    p50, p99, most = np.percentile(off, [50, 99, 100])
    print(f"  off the slot    p50 {p50:.3f}, p99 {p99:.3f}, max {most:.3f} ms")
    p50, p99, most = np.percentile(steps * 1e3, [50, 99, 100])
    print(f"  tick to tick    p50 {p50:.3f}, p99 {p99:.3f}, max {most:.3f} ms")
    print(f"  processor       {100 * cpu / wall:.1f} % of one core (emulator apart)")
    mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"  memory          {resident_mib():.0f} MiB resident, {mib:.0f} MiB at most\n")


def simulated_speed() -> None:
    """Measure simulated seconds per wall second, three runs of a minute."""
    speeds = []
    for seed in range(3):
        made = fast(seed)
        began = time.monotonic()
        summary = Summary()
        made.robot.start(made.clock)
        run(
            made.robot,
            made.clock,
            made.loop,
            lambda s: "seconds" if s >= 60.0 else None,
            summary.update,
        )
        speeds.append(60.0 / (time.monotonic() - began))
        made.robot.stop()
    print(f"simulated seconds per wall second: median {np.median(speeds):.1f}, runs "
          f"{', '.join(f'{speed:.1f}' for speed in speeds)}\n")  # fmt: skip


def stages(ticks: int = 8000) -> None:
    """Time each verb of the tick in simulated time."""
    made = fast(0)
    robot, spent = made.robot, {}
    places = {
        "read": (robot.body, "read"),
        "forward": (robot._kinematics, "forward"),
        "camera": (robot.camera, "latest"),
        "see": (robot.perception, "see"),
        "choose": (robot.attention, "choose"),
        "wander": (robot._scanpath, "wander"),
        "plan": (robot._oculomotor, "step"),
        "inverse": (robot._kinematics, "inverse"),
        "guard": (robot._guard, "check"),
        "write": (robot.body, "write"),
    }
    robot.start(made.clock)
    for name, (owner, verb) in places.items():
        spent[name] = 0.0
        setattr(owner, verb, timed(getattr(owner, verb), spent, name))
    run(
        robot,
        made.clock,
        made.loop,
        lambda s: "ticks" if s * made.loop.rate_hz >= ticks else None,
        lambda tick: None,
    )
    robot.stop()
    total = sum(spent.values())
    print(f"stages of a tick, mean of {ticks} (read and write hold driver and emulator)")
    for name, seconds in spent.items():
        print(f"  {name:8} {1e6 * seconds / ticks:7.1f} us  {100 * seconds / total:5.1f} %")
    print(f"  together {1e6 * total / ticks:7.1f} us of a 5000 us tick\n")


def bus_exchange(cycles: int = 4000) -> None:
    """Compare one read and one write of nine servos with the SDK's own group classes."""
    now = [0.0]
    specs = [(i + 1, "xl330-m077" if i < 6 else "xc330-m288", 2048) for i in range(9)]
    rig = load_rig("desk")
    setups = [rig.joints[name].setup() for name in in_order(rig.joints)]
    chain = build_dynamixel(specs, lambda: now[0])
    bus = SmartServoBus(DYNAMIXEL, InProcessPort(chain), setups, rig.bus.dynamixel)
    bus.open()
    bus.enable_torque()
    goals = [2048] * 9

    def ours() -> None:
        now[0] += 0.005
        bus.read(now[0])
        bus.write(goals)

    port = InProcessPort(build_dynamixel(specs, lambda: now[0]))
    port.openPort()
    handler = PacketHandler(2.0)
    reader, writer = GroupSyncRead(port, handler, 126, 10), GroupSyncWrite(port, handler, 116, 4)
    for servo_id, _, _ in specs:
        reader.addParam(servo_id)

    def theirs() -> None:
        now[0] += 0.005
        reader.fastSyncRead()
        for servo_id, _, _ in specs:
            reader.getData(servo_id, 132, 4)
            writer.addParam(servo_id, [0, 8, 0, 0])
        writer.txPacket()
        writer.clearParam()

    chain_only = build_dynamixel(specs, lambda: now[0])
    read = bytes.fromhex("fffffd00fe10008a7e000a00010203040506070809")
    read += crc16.umts(read).to_bytes(2, "little")

    def emulator() -> None:
        now[0] += 0.005
        chain_only.receive(read)

    ratios = []
    for _ in range(5):  # in turn, so that a drift of the machine's speed hits all
        a, b, c = (per_call(work, cycles // 5) for work in (ours, theirs, emulator))
        ratios.append((a, b, c))
    a, b, c = np.median(np.array(ratios), axis=0) * 1e6
    print("one fast sync read and one sync write of nine servos, instant port")
    print(f"  this driver with emulator  {a:7.1f} us")
    print(f"  vendor SDK with emulator   {b:7.1f} us, {b / a:.2f} times as long")
    print(f"  emulator's read alone      {c:7.1f} us")


def fast(seed: int) -> Assembly:
    """Assemble the desk rig and the visitor in simulated time."""
    return assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=seed, scene="visitor"))


def timed(work: Callable[..., Any], spent: dict[str, float], name: str) -> Callable[..., Any]:
    """Wrap a function so that its time is added up."""

    def wrapped(*args: Any) -> Any:
        began = time.perf_counter()
        result = work(*args)
        spent[name] += time.perf_counter() - began
        return result

    return wrapped


def per_call(work: Callable[[], None], times: int) -> float:
    """Return seconds per call."""
    began = time.perf_counter()
    for _ in range(times):
        work()
    return (time.perf_counter() - began) / times


def resident_mib() -> float:
    """Return the resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


if __name__ == "__main__":
    main()
