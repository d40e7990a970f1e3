"""A participant of a study without a browser."""

import json
import re
import subprocess
import urllib.error
import urllib.request
from http.cookiejar import CookieJar
from typing import Any

from branch import Branch, gazerig


class Program:
    """The command ``gazerig study run``, and a browser without a window."""

    def __init__(self, *words: str) -> None:
        self.process = Branch(gazerig("study", "run", *words), stderr=subprocess.PIPE, text=True)
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
