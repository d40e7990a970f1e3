"""Floods, silent and malformed connections against the page of a running rig. Prints a table.

    PYTHONPATH=tests python tests/attack/page_attack.py [seconds of each [names of attacks]]

A simulated rig runs in a process of its own, its page on the loopback. Each attack runs in
another process; meanwhile the loop's rate is counted, then STOP is pressed 20 times as the
page's script does, over an open connection, and then over a new one each time. "taken"
counts those that the rig acknowledged at the first try, "slowest" is from the press to that;
"loop" is the rate next to that without an attack, "page" and "rig" are the most memory in MB.
An attack counts only if its loop ticked and was not stopped before it, its first request was
answered as it should be, and it was still going on at the end; any other ends the script.
"""

import contextlib
import json
import os
import random
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from urllib.parse import urlsplit

from page_visitor import LOOKING, Visitor
from websockets.sync.client import ClientConnection

from gazerig.robot.remote.client import RobotClient

CLIENTS = 8
PRESSES = 20


# --- attacks: each runs until its process is killed -------------------------------------------


def post(visitor: Visitor, body: bytes, token: bool = True, code: int = 204) -> None:
    """Post the same again and again over connections that are kept as long as they may.

    code: what the first one is answered with
    """
    parts = urlsplit(visitor.url)
    cookie = f"Cookie: {visitor.headers['Cookie']}\r\n" if token else ""
    head = (
        f"POST /rig/ask HTTP/1.1\r\nHost: {parts.netloc}\r\nOrigin: {visitor.url}\r\n{cookie}"
        f"Content-Length: {len(body)}\r\n\r\n"
    ).encode()

    with _connection(visitor) as there:
        there.sendall(head + body)
        answer = there.recv(1 << 16)
        assert answer.startswith(b"HTTP/1.1 %d" % code), answer

    def one() -> None:
        while True:
            with contextlib.suppress(OSError), _connection(visitor) as there:
                while True:
                    there.sendall(head + body)
                    if not there.recv(1 << 16):
                        break

    _in_threads(one)


def work_alone(visitor: Visitor) -> None:
    """No attack: what it takes of the processor alone."""

    def one() -> None:
        while True:
            pass

    _in_threads(one)


def big_posts(visitor: Visitor) -> None:
    """60 kB objects."""
    post(visitor, json.dumps({"pick": "x" * 60_000}).encode(), code=413)


def stranger_posts(visitor: Visitor) -> None:
    """60 kB objects without the token."""
    post(visitor, json.dumps({"pick": "x" * 60_000}).encode(), token=False, code=403)


def orders(visitor: Visitor) -> None:
    """Points to look at."""
    post(visitor, b'{"do": "look_at", "p_world_m": [1.0, 0.2, 0.3]}')


def parameters(visitor: Visitor) -> None:
    """Changes of a parameter."""
    post(visitor, b'{"do": "set", "changes": {"gaze.head.eye_only_range_deg": 30.0}}')


def stops(visitor: Visitor) -> None:
    """Other people's stops."""
    post(visitor, b'{"do": "stop", "why": "a flood"}')


def silent(visitor: Visitor) -> None:
    """200 silent connections, opened again whenever they are closed."""
    _hold(visitor, b"")


def slow(visitor: Visitor) -> None:
    """200 connections that send a byte a second."""
    _hold(visitor, b"G")


def deaf(visitor: Visitor) -> None:
    """The page's websockets, as many as there may be, that read nothing."""
    held = []
    while True:
        with contextlib.suppress(Exception):
            talk = visitor.open(receive_bytes=4096)
            talk.send(LOOKING)
            held.append(talk)
        time.sleep(0.05)


def lines(visitor: Visitor) -> None:
    """Connections of stop buttons that read nothing."""
    held = []
    while True:
        with contextlib.suppress(Exception):
            held.append(visitor.open("/rig/line", receive_bytes=4096))
        time.sleep(0.02)


def huge(visitor: Visitor) -> None:
    """Websocket messages of 600 MB, as far as they are taken."""

    def one() -> None:
        piece = bytes(1 << 20)
        while True:
            with contextlib.suppress(Exception), visitor.open() as talk:
                talk.send(piece for _ in range(600))

    _in_threads(one, 2)


def messages(visitor: Visitor) -> None:
    """Small and malformed websocket messages as fast as they are taken."""

    def one() -> None:
        dice = random.Random(0)
        while True:
            with contextlib.suppress(Exception), visitor.open() as talk:
                while True:
                    talk.send(dice.choice((LOOKING, dice.randbytes(200), b"\x80")))

    _in_threads(one, 4)


def garbage(visitor: Visitor) -> None:
    """Bytes that are no HTTP."""

    def one() -> None:
        dice = random.Random(0)
        while True:
            with contextlib.suppress(OSError), _connection(visitor) as there:
                there.sendall(dice.randbytes(5000))
                there.recv(4096)

    _in_threads(one)


ATTACKS: dict[str, Callable[[Visitor], None]] = {
    attack.__name__: attack
    for attack in (
        work_alone, big_posts, stranger_posts, orders, parameters, stops, silent, slow, deaf,
        lines, huge, messages, garbage,
    )
}  # fmt: skip


def _connection(visitor: Visitor) -> socket.socket:
    parts = urlsplit(visitor.url)
    return socket.create_connection((parts.hostname, parts.port), timeout=10.0)


def _in_threads(work: Callable[[], None], count: int = CLIENTS) -> None:
    threads = [threading.Thread(target=work, daemon=True) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _hold(visitor: Visitor, data: bytes) -> None:
    held: list[socket.socket] = []
    while True:
        while len(held) < 200:
            with contextlib.suppress(OSError):
                held.append(_connection(visitor))
        time.sleep(1.0)
        for there in tuple(held):
            there.setblocking(False)
            try:
                if data:
                    there.send(data)
                elif there.recv(1) == b"":
                    raise OSError
            except BlockingIOError:
                continue
            except OSError:
                held.remove(there)
                there.close()


# --- the rig and what is measured --------------------------------------------------------------


class Rig:
    """A simulated rig with its page, in a process of its own."""

    def __init__(self) -> None:
        code = "from gazerig.robot.cli.main import main; main()"
        words = ["run", "--mock", "--page", "127.0.0.1:18790"]
        self._process = subprocess.Popen(
            [sys.executable, "-u", "-c", code, *words],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        self._there = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._there.wait()
        self.remote = RobotClient.connect(self._process.pid)
        self.address = str(self.remote.status()["page"])

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if "the page is at " in line:
                self._there.set()

    def ticks(self) -> int:
        return int(str(self.remote.status()["ticks"]))

    def pids(self) -> tuple[int | None, int]:
        """The page's process and the rig's."""
        for entry in Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                words = (entry / "cmdline").read_bytes().split(b"\0")
                if (
                    b"gazerig.robot.dashboard.page_main" in words
                    and str(self._process.pid).encode() in words
                ):
                    return int(entry.name), self._process.pid
        return None, self._process.pid

    def close(self) -> None:
        self._process.send_signal(signal.SIGINT)
        self._process.wait(30.0)


def rate_hz(rig: Rig, seconds: float) -> float:
    """Ticks a second of the loop."""
    before, began = rig.ticks(), time.monotonic()
    time.sleep(seconds)
    return (rig.ticks() - before) / (time.monotonic() - began)


def megabytes(pid: int | None) -> float:
    """The memory of a process now."""
    if pid is None:
        return 0.0
    with contextlib.suppress(OSError):
        return (
            int(Path(f"/proc/{pid}/statm").read_text().split()[1])
            * os.sysconf("SC_PAGE_SIZE")
            / 1e6
        )
    return 0.0


def press(visitor: Visitor, standing: ClientConnection) -> tuple[list[float], int]:
    """Press STOP over an open connection, and over new ones; times in ms, and failures."""
    took, failed = [], 0
    for number in range(PRESSES):
        began = time.monotonic()
        try:
            if number % 2:
                taken = visitor.ask({"do": "stop", "why": "attack"}) == 204
            else:
                standing.send('{"do": "stop", "why": "attack"}')
                while "answer" not in (said := json.loads(standing.recv(timeout=10.0))):
                    pass
                taken = said["answer"] == 204
        except Exception:
            taken = False
        if taken:
            took.append(1e3 * (time.monotonic() - began))
        else:
            failed += 1
        time.sleep(0.05)
    return took, failed


def attacked(rig: Rig, name: str, seconds: float, quiet_hz: float) -> float:
    """Attack, and print one line; return the rate of the loop."""
    visitor = Visitor(rig.address)
    standing = visitor.open("/rig/line")
    visitor.open().close()
    assert not rig.remote.status()["stopped"] and rate_hz(rig, 0.5) > 0.0, "the rig does not run"
    attacker = None
    errors = TemporaryFile()  # noqa: SIM115
    if name != "nothing":
        command = [sys.executable, __file__, "--attack", name, rig.address]
        attacker = subprocess.Popen(command, stderr=errors)
        time.sleep(1.5)
    before = rig.pids()
    assert before[0] is not None, "there is no page"
    most = [0.0, 0.0]
    over = threading.Event()

    def weigh() -> None:
        while not over.wait(0.1):
            for place, pid in enumerate(before):
                most[place] = max(most[place], megabytes(pid))

    scales = threading.Thread(target=weigh)
    scales.start()
    try:
        hz = rate_hz(rig, seconds)
        took, failed = press(visitor, standing)
        standing.close()
        obeyed = bool(rig.remote.status()["stopped"])
        errors.seek(0)
        ended = attacker is not None and attacker.poll() is not None
        assert not ended, f"{name}: the attack had ended: {errors.read().decode()}"
    finally:
        over.set()
        scales.join()
        if attacker is not None:
            attacker.kill()
            attacker.wait()
        errors.close()
    same = rig.pids()[0] == before[0]
    beside = f"{100 * hz / quiet_hz:4.0f} %" if quiet_hz else f"{hz:4.0f} Hz"
    slowest = f"{max(took):7.0f}" if took else "      -"
    print(
        f"{name:16} {len(took):3d} of {len(took) + failed:2d} {slowest} ms  "
        f"{'yes' if obeyed else 'NO':6} {beside:>8} {most[0]:7.0f} {most[1]:7.0f}  "
        f"{'lives' if same else 'DIED'}",
        flush=True,
    )
    for _ in range(20):
        time.sleep(2.0)
        with contextlib.suppress(Exception):
            rig.remote.resume(confirmed=True)
            break
    time.sleep(1.5)
    return hz


def main(seconds: float, names: list[str]) -> None:
    """Run every attack."""
    rig = Rig()
    print("attack             STOP taken, slowest  obeyed     loop page MB  rig MB  page")
    try:
        quiet_hz = attacked(rig, "nothing", seconds, 0.0)
        for name in names or ATTACKS:
            attacked(rig, name, seconds, quiet_hz)
    finally:
        rig.close()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--attack"]:
        ATTACKS[sys.argv[2]](Visitor(sys.argv[3]))
    else:
        main(float(sys.argv[1]) if len(sys.argv) > 1 else 4.0, sys.argv[2:])
