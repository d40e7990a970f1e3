"""Lateness of the control loop without a door, and with one that gives ten orders a second.

python tests/bench/bench_doors.py [--seconds 20]
"""

import argparse
import asyncio
import os
import sys
import tempfile
import threading
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fakes.voice_assistant import Assistant, lva

import gazerig
from gazerig.config.load import shipped_path
from gazerig.robot.app import run_observers
from gazerig.robot.control.loop_timing import LoopTiming

EVENTS = ("listening", "thinking", "tts_speaking", "idle")
EVERY_S = 0.1


async def talk(assistant: Assistant, ended: threading.Event) -> None:
    async with assistant:
        number = 0
        while not ended.is_set():
            await asyncio.sleep(EVERY_S)
            if assistant.sockets and not assistant.sockets[-1].closed:
                number += 1
                await assistant.send(lva(EVENTS[number % len(EVENTS)]))


made: list[LoopTiming] = []


class KeptTiming(LoopTiming):
    def __init__(self, rate_hz: float) -> None:
        super().__init__(rate_hz)
        made.append(self)


def measure(rig: str, seconds: float) -> str:
    with gazerig.open(rig, mock=True, scene="face-to-face", say=lambda line: None) as head:
        head.sleep(5.0)  # all processes have started
        before = made[-1].figures()
        head.sleep(seconds)
        now = made[-1].figures()
    assert before is not None and now is not None
    skipped = now.overruns_ever - before.overruns_ever
    return f"{now.p50_ms:.2f} ms median, {now.p99_ms:.2f} ms p99, {skipped} slots skipped"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0)
    seconds = parser.parse_args().seconds
    run_observers.LoopTiming = KeptTiming  # type: ignore[misc]
    text = shipped_path("rigs", "desk").read_text(encoding="utf-8")
    assistant, ended = Assistant(), threading.Event()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_RUNTIME_DIR"] = folder
        rig = Path(folder, "desk.yaml")
        rig.write_text(text, encoding="utf-8")
        print("without a door", measure(str(rig), seconds))
        door = f"doors: [voice-assistant ws://127.0.0.1:{assistant.port}]\n"
        rig.write_text(f"{text}\n{door}", encoding="utf-8")
        thread = threading.Thread(target=lambda: asyncio.run(talk(assistant, ended)))
        thread.start()
        try:
            print("with a door   ", measure(str(rig), seconds))
        finally:
            ended.set()
            thread.join()


if __name__ == "__main__":
    main()
