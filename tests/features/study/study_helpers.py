"""A participant without a browser."""

import itertools
import json
import re
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Callable
from http.cookiejar import CookieJar
from pathlib import Path
from typing import Any

from gazerig.features.study.design import load_study
from gazerig.features.study.journal import Journal
from gazerig.features.study.session import PageEvent, StudySession


def session_of(study: Path, journal: Journal) -> StudySession:
    """A session whose clock advances by a minute whenever it is read."""
    now_s = itertools.count(0.0, 60.0).__next__
    return StudySession(load_study(str(study)), 1, journal, now_s, lambda: "now")


def events(session: StudySession) -> list[str]:
    """Do what each page asks for to the end; return the steps."""
    steps: list[str] = []
    do = {"consent": "consent", "ready": "begin", "presentation": "seen", "questions": "answer"}
    while (step := session.place.step) != "end":
        steps.append(step)
        session.film_fetched()
        kinds = {"rating": 3, "choice": "first", "text": "well"}
        values: list[Any] = [kinds[item.kind] for _, item in session.items()]
        assert session.handle(PageEvent(session.page, do[step], values, [900.0] * len(values)))
    return steps


class Program:
    """The command ``gazerig study run``, and a browser without a window."""

    def __init__(self, *words: str) -> None:
        main = "from gazerig.robot.cli.entry_point import main; main()"
        command = [sys.executable, "-c", main, "study", "run", *words]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        self.said = ""
        for line in self.process.stderr:
            self.said += line
            if found := re.search(r"participant: (http://\S+)/\?token=(\S+)", line):
                break
        else:
            raise AssertionError(self.said)
        self.url, self.token = found.groups()
        self._opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor(CookieJar()))
        self.fetch(f"/?token={self.token}")

    def fetch(self, path: str, body: dict[str, Any] | None = None) -> tuple[int, bytes]:
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(
            self.url + path, data, {"Origin": self.url} if data else {}
        )
        for _ in range(300):
            try:
                with self._opener.open(request, timeout=30.0) as answer:
                    return answer.status, answer.read()
            except urllib.error.HTTPError as error:
                return error.code, error.read()
            except urllib.error.URLError:  # it does not listen yet
                assert self.process.poll() is None, self.said
        raise AssertionError("no answer")

    def page(self) -> dict[str, Any]:
        found: dict[str, Any] = json.loads(self.fetch("/page")[1])
        return found

    def do(self, page: dict[str, Any], do: str, **more: Any) -> int:
        return self.fetch("/event", {"page": page["page"], "do": do, **more})[0]


Start = Callable[..., Program]
