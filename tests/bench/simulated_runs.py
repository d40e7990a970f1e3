"""Runs in simulated time: how fast they are on either bus, and what their emulated servos cost."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import pytest

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.control.loop import run
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.motor import Shaft
from gazerig.sim_mock.wire import ServoLine

RIGS = ("desk", "feetech", "maker")
BEGIN_S = 1.0
"""So long joints start slowly; it is not measured."""
SLICE = 50
"""Packets that are timed together when they are sent again."""
now_ns = time.thread_time_ns


class Sent(NamedTuple):
    """One packet of a run."""

    at_s: float
    data: bytes
    baud: int


def simulated(rig: str, bus: str, seconds: float) -> float:
    """Return simulated seconds a second of processor, scene visitor."""
    made = assemble(load_rig(rig), RunOptions(True, True, 0, "visitor", bus=bus))
    try:
        made.robot.start(made.clock)
        _go(made, BEGIN_S)
        began = now_ns()
        _go(made, seconds)
        return seconds / (now_ns() - began) * 1e9
    finally:
        made.close()


def _go(made: Any, seconds: float) -> None:
    def stop(at_s: float) -> str | None:
        return "seconds" if at_s >= seconds else None

    run(made.robot, made.clock, lambda: made.loop, stop, lambda tick: None)


def sent_by(rig: str, seconds: float) -> list[Sent]:
    """Return what a run sends to its emulated servos."""
    sent: list[Sent] = []
    write = InProcessPort.write

    def kept(port: InProcessPort, data: bytes) -> None:
        sent.append(Sent(port.now_s(), bytes(data), port.baudrate))
        write(port, data)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(InProcessPort, "write", kept)
        simulated(rig, "emulated", seconds)
    return sent


class EmulatedCost(NamedTuple):
    """Microseconds of processor a tick: all, and of it replies, other packets and motion."""

    whole: float
    replies: float
    others: float
    motion: float


def emulated_cost(rig: str, seconds: float = 10.0, rounds: int = 12) -> EmulatedCost:
    """Send a run's packets to the emulated servos again and again; the least of each slice counts.

    So other load on the machine hardly counts, and caches are warm.
    """
    sent = sent_by(rig, seconds)
    first = next(i for i, one in enumerate(sent) if one.at_s >= BEGIN_S)
    ticks = (sent[-1].at_s - sent[first].at_s) * load_rig(rig).loop.rate_hz
    whole = _least(rig, sent, first, rounds, _all)
    replies = _least(rig, sent, first, rounds, _replies)
    with _timed_motion() as spent:
        motion = _least(
            rig, sent, first, rounds, lambda line, now, part: _spent(line, now, part, spent)
        )
    us = [ns / ticks / 1e3 for ns in (whole, replies, whole - replies, motion)]
    return EmulatedCost(*us)


_Take = Callable[[ServoLine, list[float], list[Sent]], float]


def _least(rig: str, sent: list[Sent], first: int, rounds: int, take: _Take) -> float:
    """Return the nanoseconds of all slices, of each the least of all rounds."""
    least: dict[int, float] = {}
    (line,) = emulated_lines(load_rig(rig)).values()
    for _ in range(rounds):
        now = [0.0]
        port = ServoLine(build(line, lambda now=now: now[0]))  # type: ignore[misc]
        _all(port, now, sent[:first])
        for at in range(first, len(sent), SLICE):
            took = take(port, now, sent[at : at + SLICE])
            least[at] = min(least.get(at, took), took)
    return sum(least.values())


def _all(line: ServoLine, now: list[float], part: list[Sent]) -> float:
    began = now_ns()
    for at_s, data, baud in part:
        now[0] = at_s
        line.send(data, baud)
    return now_ns() - began


def _replies(line: ServoLine, now: list[float], part: list[Sent]) -> float:
    """Time what is answered: reads, and with them the motion since the tick before."""
    took = 0.0
    for at_s, data, baud in part:
        now[0] = at_s
        began = now_ns()
        answer = line.send(data, baud)
        if answer:
            took += now_ns() - began - _TIMER_NS
    return took


def _spent(line: ServoLine, now: list[float], part: list[Sent], spent: list[float]) -> float:
    spent[0] = 0.0
    _all(line, now, part)
    return spent[0]


@contextmanager
def _timed_motion() -> Iterator[list[float]]:
    spent, advance = [0.0], Shaft._advance

    def timed(shaft: Shaft, ticks: int) -> None:
        began = now_ns()
        advance(shaft, ticks)
        spent[0] += now_ns() - began - _TIMER_NS

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Shaft, "_advance", timed)
        yield spent


def _timer_ns() -> float:
    """Return the least cost of one call of the clock."""
    return min(_hundred() for _ in range(200)) / 100.0


def _hundred() -> float:
    began = now_ns()
    for _ in range(99):
        now_ns()
    return now_ns() - began


_TIMER_NS = _timer_ns()
