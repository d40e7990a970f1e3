"""Random faults for simulated hours: PYTHONPATH=tests python tests/attack/soak.py --hours 12 KIND

A rig moves on emulated buses of one kind in simulated time while up to three faults at once strike
its line, its board or its servos: noise, collisions, lost bytes, delays, echoes, unplugged
adapters, brown-outs. After each mix the machine must come back, or name what a person has to do.
Every fresh value is compared with the true servo, from the first request of a read to its end:

wrong: a position that the joint did not have then, a temperature or a voltage that it has not had
stale: a position that the joint had within the last second, and has left
outside: a servo had a goal outside its range, or moved out of it or too fast
off: positions estimated by the driver (hobby servos) that are more than 3.4 degrees away
shared: a position of neither of two Feetech servos with one id. They answer together, and the AND
    of their bytes passes a check of 8 bits now and then, twice in a row too; not a driver's fault
"""

import argparse
import os
import random
import sys
import time
from collections import Counter, deque
from collections.abc import Sequence
from math import inf
from pathlib import Path
from resource import RUSAGE_SELF, getrusage

sys.path.insert(0, str(Path(__file__).parents[1]))

import fault_machine  # noqa: E402
import struck_rigs  # noqa: E402
from fault_machine import NEAR_RAD, ROOM_RAD, Case, Machine, RuleViolation  # noqa: E402
from struck_rigs import CASES, VOLTS, quick  # noqa: E402

from gazerig.drivers.errors import DriverError  # noqa: E402
from gazerig.robot.model.types import JointState  # noqa: E402
from gazerig.sim_mock.smart_servo.chain import ServoChain  # noqa: E402

SEEN_RAD = 0.004
ROOM_C, ROOM_V = 2.0, 0.15
PAST_S = 1.0
MOST_PRINTED = 3
"""Wrong values of one mix of faults that are printed."""
EPISODES = 40
"""Mixes of faults until another machine is built."""

NOISE_ROOM_RAD = {"maestro": inf, "feetech": 0.6}
"""How far noise may drive a joint out of its range, which no driver can prevent.

One damaged command in 128 passes a Maestro's check of 7 bits, one in 256 a Feetech servo's check
of 8 bits. The servo keeps its own range, but a damaged goal time makes it arrive at full speed:
3549 steps/s need 370 steps to brake at 17,000 steps/s2.
"""

STATIC = [Case((f"static {percent}",)) for percent in (0.1, 0.5, 2.0, 10.0)]


class Struck(Machine):
    """A machine whose line may be noisy.

    noisy: noise also hits bytes to the servos. A damaged goal can pass their check and stays for
        a tick; the servo's own range still limits it
    """

    noisy = False

    def true_goal(self, i: int) -> int | None:
        """Return the goal that a joint's servo follows; None if it is limp."""
        goal, setup = super().true_goal(i), self.setups[i]
        if goal is None or not self.noisy:
            return goal
        return min(max(goal, setup.min_steps), setup.max_steps)


class Watch:
    """Compares every reading of a machine with its true servos, and counts.

    counts: by "fresh", "wrong", "stale", "outside", "off" and "shared"
    where: the machine and its faults, for printed lines
    """

    def __init__(self, machine: Machine, counts: Counter[str]) -> None:
        self.where, self._counts, self._machine = "", counts, machine
        self._printed = Counter[str]()
        self._past: deque[tuple[float, list[list[float]], list[list[tuple[float, float]]]]] = (
            deque()
        )
        self._around: dict[int, tuple[float | None, float | None]] = {}
        self._read = machine.body.read
        machine.body.read = self.read  # type: ignore[method-assign]
        self._seen: list[list[list[float]]] = []
        self._shared: set[int] = set()
        machine.body.bus._port._tap = self._record_request  # type: ignore[attr-defined]

    def _record_request(self, data: bytes) -> None:
        """Record the true state at each request: a right answer holds one of these."""
        self._seen.append(self._note())

    def _note(self) -> list[list[float]]:
        """Record the true state now; return the possible angles of each joint.

        A second servo with the id of a joint counts as well: no driver can distinguish them.
        """
        machine, now_s = self._machine, self._machine.clock.now_s()
        true, around = [[angle] for angle in machine.true_rad()], list[list[tuple[float, float]]]()
        for i, (bus, place) in enumerate(machine.places):
            device, setup = machine.devices[bus], machine.setups[i]
            if not isinstance(device, ServoChain):
                continue
            servos, linkage = device.servos, machine.linkages[i]
            own = servos[place]
            others = [one for one in servos if one.id == setup.id and one is not own]
            if (
                others
                and machine.rig.bus_named(machine.rig.joints[machine.names[i]].bus).kind
                == "feetech"
            ):
                self._shared.add(i)
            true[i] += [linkage.angle_rad(one.position_steps) for one in others]
            around.append([(float(one.warmth_c), 0.1 * one.voltage_01v) for one in (own, *others)])
        self._past.append((now_s, true, around))
        while self._past[0][0] < now_s - PAST_S:
            self._past.popleft()
        return true

    def read(self, t_s: float) -> JointState:
        """Read, and compare with the truth before, meanwhile and after."""
        self._shared.clear()
        self._seen = [self._note()]
        joints = self._read(t_s)
        self._seen.append(self._note())
        for i, name in enumerate(self._machine.names):
            if name in joints.missing:
                continue
            now = joints.position_rad[i]
            seen = [
                (min(way), max(way)) for way in zip(*[one[i] for one in self._seen], strict=False)
            ]
            if not joints.measured[i]:
                self._counts["off"] += not _between(now, seen, NEAR_RAD)
                continue
            self._counts["fresh"] += 1
            if not _between(now, seen, SEEN_RAD):
                stale = any(abs(now - one) <= SEEN_RAD for past in self._past for one in past[1][i])
                what = "stale" if stale else "shared" if i in self._shared else "wrong"
                self._counts[what] += 1
                self._report(
                    f"{t_s:.3f} s {name} at {now:.4f} rad, truly {seen}; heard "
                    f"{joints.measured_s[i] - t_s:+.4f} s, rearmed {joints.rearmed[i]}, "
                    f"torque {joints.torque[i]}, {what}"
                )
            self._judge_around(i, joints)
        return joints

    def _judge_around(self, i: int, joints: JointState) -> None:
        """Judge a temperature or a voltage that is new."""
        said = joints.temperature_c[i], joints.voltage_v[i]
        if said == self._around.get(i):
            return
        self._around[i] = said
        for nth, (value, room) in enumerate(zip(said, (ROOM_C, ROOM_V), strict=True)):
            was = [one[nth] for past in self._past for one in past[2][i]]
            if value is not None and not min(was) - room <= value <= max(was) + room:
                self._counts["wrong"] += 1
                self._report(
                    f"{self._machine.names[i]} has {value:.2f} {'CV'[nth]}, truly "
                    f"{min(was):.2f} to {max(was):.2f}"
                )

    def _report(self, text: str) -> None:
        self._printed[self.where] += 1
        if self._printed[self.where] <= MOST_PRINTED:
            print(f"{self.where}: {text}", flush=True)


def _between(angle: float, seen: Sequence[tuple[float, float]], room: float) -> bool:
    """Return whether a joint was at an angle between one place and the next."""
    return any(low - room <= angle <= high + room for low, high in seen)


def mix(kind: str, dice: random.Random, only: str = "") -> Case:
    """Return up to three faults at once, of those whose name contains a text."""
    # No byte to a PCA9685 has a check: noise moves its pulses, and nothing can prevent that.
    noise = STATIC * 3 if kind != "pca9685" else []
    cases = [case for case in (*CASES[kind], *noise) if only in case.name]
    some = dice.sample(cases, min(len(cases), dice.choice((1, 1, 2, 3))))
    if any("reset" in case.name for case in some):  # no servo has that id any more
        some = [c for c in some if "reset" in c.name or "{i}" not in str(c)]
    # A script in a board moves a servo out of its range until the driver can end it.
    some = [case for case in some if "script {i}" in case.name] or some
    begins = tuple(text for case in some for text in case.begins)
    ends = tuple(text for case in some for text in case.ends)
    # The position of a servo after its script and its pulses have ended is unknown.
    lost = len(some) > 1 and any("script on" in case.begins for case in some)
    return Case(begins, ends, lost or any(case.own_speed or case in STATIC for case in some))


def soak(kind: str, hours: float, seed: int, first: int = 0, only: str = "") -> None:
    """Strike one machine after the other and print what was found."""
    fault_machine.PATIENCE_S = 8.0  # a bus that was late long is slow for a while
    counts, ends, seen_s, faults, nth = Counter[str](), Counter[str](), 0.0, 0, first
    start_cpu_s, printed_h = time.process_time(), 0.0
    while seen_s < 3600.0 * hours:
        dice = random.Random(f"{seed} {kind} {nth}")
        rig = struck_rigs.rig_of(kind)
        machine = Struck(
            quick(rig) if dice.random() < 0.6 else rig, dice.choice((50.0, 100.0, 200.0)), nth
        )
        machine.volts = VOLTS[kind]
        watch, start_s = Watch(machine, counts), machine.clock.now_s()
        bus = machine.rig.joints[machine.names[0]].bus
        try:
            machine.start()
            for _ in range(EPISODES):
                case = mix(kind, dice, only)
                i, j = dice.sample(range(len(machine.names)), 2)
                watch.where = f"{kind} {seed} {nth}: {case.name} ({machine.names[i]})"
                machine.noisy = "static" in case.name
                machine.room_rad = NOISE_ROOM_RAD.get(kind, ROOM_RAD) if machine.noisy else ROOM_RAD
                outcome = machine.apply_fault(bus, i, j, case, dice.uniform(0.05, 2.0))
                faults += len(case.begins)
                ends[outcome.end if outcome.survived else "unnamed"] += 1
                if not outcome.survived:
                    print(f"{watch.where}: {outcome.end}", flush=True)
                if outcome.end != "came back":
                    break  # a person has to help: another machine
        except RuleViolation as broken:
            counts["outside"] += 1
            print(f"{watch.where}: {broken}", flush=True)
        except DriverError as error:
            ends["ended"] += 1
            print(f"{watch.where}: {type(error).__name__}: {error}", flush=True)
        seen_s += machine.clock.now_s() - start_s
        nth += 1
        if seen_s / 3600.0 - printed_h >= 0.1 or seen_s >= 3600.0 * hours:
            printed_h = seen_s / 3600.0
            row = ", ".join(
                f"{key} {counts[key]}"
                for key in ("fresh", "wrong", "stale", "outside", "off", "shared")
            )
            print(
                f"== {kind} {printed_h:.2f} h, {faults} faults, {row}; {dict(ends)}; machine {nth}, "
                f"{time.process_time() - start_cpu_s:.0f} s of processor, "
                f"{getrusage(RUSAGE_SELF).ru_maxrss / 1024.0:.0f} MB, "
                f"{len(os.listdir('/proc/self/fd'))} files",
                flush=True,
            )


def main() -> None:
    """Soak one kind after the other."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("kinds", nargs="*", default=list(CASES), help=", ".join(CASES))
    parser.add_argument("--hours", type=float, default=12.0, help="simulated, of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--first", type=int, default=0, help="machine to begin with")
    parser.add_argument("--only", default="", help="faults whose name contains this")
    args = parser.parse_args()
    for kind in args.kinds:
        soak(kind, args.hours, args.seed, args.first, args.only)


if __name__ == "__main__":
    main()
