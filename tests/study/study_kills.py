"""A study's program killed repeatedly while a participant answers; kept answers are counted.

A participant answers through HTTP as a browser does, sends again what was not answered, and notes
every page that was confirmed. The program is killed (SIGKILL) at random moments and started
again.
"""

import contextlib
import json
import os
import random
import re
import signal
import subprocess
import threading
import time
import urllib.error
from collections.abc import Callable, Iterator
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from branch import Branch, gazerig
from study_at_the_page import Tab, answers

from gazerig.drivers.files.film_writer import film_writer
from gazerig.features.study.journal import ItemAnswered, ParticipationClosed, read
from gazerig.robot.model import clock

STUDY = """\
title: Two films
conditions:
  a: {film: a.webm}
  b: {film: b.webm}
trials: {seconds: 2, practice: 1, repetitions: 20, rest_every: 5, rest_s: 0}
questionnaires: [nakamoto_tsuruno, rosas]
after: [free_text]
plan: {participants: 2}
privacy: {contact: someone@example.org}
"""
_GONE = (urllib.error.URLError, ConnectionError, TimeoutError, OSError)
Page = tuple[str, ...]
"""The answers of a page in order."""


class Kills(NamedTuple):
    """Fate of the answers.

    kept: confirmed answers; lost: those that are not in the journal
    twice: answers that are there more than once
    participants: who finished meanwhile
    """

    kills: int
    kept: int
    lost: int
    twice: int
    participants: int


def write_study(folder: Path) -> Path:
    """Write a study with two small films; return its file."""
    for number, name in enumerate("ab"):
        with film_writer(folder / f"{name}.webm", (64, 64), 10.0) as write:
            for _ in range(20):
                write(np.full((64, 64, 3), 90 * number + 40, np.uint8))
    file = folder / "films.yaml"
    file.write_text(STUDY, encoding="utf-8")
    return file


def killed(folder: Path, kills: int, seed: int = 0, longest_s: float = 0.6) -> Kills:
    """Kill a session's program n times, each time at a random moment.

    Args:
        folder: an empty one.
        kills: how often.
        seed: of the moments.
        longest_s: from the first page to the kill, at most.
    """
    file, rng = write_study(folder), random.Random(seed)
    told: dict[int, list[Page]] = {}
    number, done = 1, 0
    while done < kills:
        with _program(file, folder, number) as (process, url):
            kill = process.send_signal, [signal.SIGKILL]
            timer = threading.Timer(rng.uniform(0.0, longest_s), *kill)
            timer.start()
            over = _answers_until_gone(url, told.setdefault(number, []))
            timer.cancel()
        done += not over
        number += over or _ended(folder, number)
    return _counted(folder, told, done)


def _ended(folder: Path, number: int) -> bool:
    """Whether a participant's session is over, though it was not reported."""
    place = folder / "data" / "participants" / f"P{number:03d}"
    return place.exists() and any(isinstance(one, ParticipationClosed) for one in read(place))


@contextlib.contextmanager
def _program(file: Path, folder: Path, number: int) -> Iterator[tuple[Branch, str]]:
    """Start the program; give the participant's address; end it if it lives."""
    words = (
        "study", "run", str(file), "--participant", str(number),
        "--data", str(folder / "data"), "--page", f"127.0.0.1:{_PORT}", "--no-browser",
    )  # fmt: skip
    process = Branch(
        _at_speed(gazerig(*words)), stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True
    )
    try:
        assert process.stderr is not None
        lines = []
        for line in process.stderr:
            lines.append(line)
            if found := re.search(r"participant: (\S+)", line):
                threading.Thread(target=process.stderr.read, daemon=True).start()
                yield process, found[1]
                break
        else:
            raise AssertionError(f"it did not start: {lines}")
    finally:
        if process.poll() is None:
            process.kill()
        process.wait()


def _at_speed(program: Callable[[], None]) -> Callable[[], None]:
    """Return a program whose clock is 10,000 times as fast, so that no film takes long."""

    class FastClock(clock.RealClock):
        def now_s(self) -> float:
            return 1e4 * super().now_s()

        def sleep_until(self, t_s: float) -> None:
            time.sleep(0.05)

    def work() -> None:
        clock.RealClock = FastClock  # type: ignore[misc]
        program()

    return work


_PORT = 20000 + os.getpid() % 20000


def _answers_until_gone(url: str, told: list[Page]) -> bool:
    """Answer until the program is gone; return whether the session was over before."""
    try:
        tab = Tab(url)
        page = tab.page()
        while page["kind"] != "end":
            if page["kind"] == "questions":
                page = _answered(tab, page, told)
            else:
                page = tab.goes_through(page)
    except _GONE:
        return False
    except (AssertionError, ValueError, json.JSONDecodeError):  # an answer cut in its middle
        return False
    return True


def _answered(tab: Tab, page: dict[str, Any], told: list[Page]) -> dict[str, Any]:
    """Answer a page; note its answers once the program has confirmed them."""
    said = answers(page, 1 + len(told) % 5)
    status, following = tab.send(page["page"], do="answer", answers=said)
    if status == 200:
        told.append(tuple(str(one["value"]) for one in said))
        assert isinstance(following, dict)
        return following
    time.sleep(0.02)
    return tab.page()


def _counted(folder: Path, told: dict[int, list[Page]], kills: int) -> Kills:
    """Compare the confirmations to participants with their journals.

    A journal may hold a page whose confirmation was cut off by the kill, but none less, none twice,
    and all in their order.
    """
    kept = lost = twice = finished = 0
    for number, pages in told.items():
        records = read(folder / "data" / "participants" / f"P{number:03d}")
        found = [one for one in records if isinstance(one, ItemAnswered)]
        there = iter(
            tuple(str(one.value) for one in items)
            for _, items in groupby(found, key=lambda one: (one.trial, one.questionnaire))
        )
        lost += sum(len(page) for page in pages if page not in there)
        keys = [(one.trial, one.questionnaire, one.item) for one in found]
        kept += sum(map(len, pages))
        twice += len(keys) - len(set(keys))
        finished += isinstance(records[-1], ParticipationClosed)
    return Kills(kills, kept, lost, twice, finished)
