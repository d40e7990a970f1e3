"""A Python that has loaded what a control loop needs, and nothing else, for questions in forks.

Loading that takes half a second of a processor, as much as most of what is asked. What a fork
imports beyond it, the others do not have.
"""

import json
import subprocess
import sys
from pathlib import Path

_SERVES = """
import atexit, json, os, sys, threading, traceback
import gazerig.robot.run.session
print("loaded", flush=True)
for line in sys.stdin:
    asked = json.loads(line)
    fork = os.fork()
    if fork == 0:
        for stream, file in enumerate(asked["said"], 1):
            os.dup2(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_APPEND), stream)
        status = 0
        try:
            os.chdir(asked["folder"])
            exec(asked["code"], {"__name__": "__main__"})
        except BaseException:
            traceback.print_exc()
            status = 1
        threading._shutdown()
        atexit._run_exitfuncs()
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    print(os.waitstatus_to_exitcode(os.waitpid(fork, 0)[1]), flush=True)
"""


class LightPython:
    """Runs code in a process that has imported gazerig.robot.run.session alone."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._count = folder, 0
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(
            [sys.executable, "-c", _SERVES], stdin=pipe, stdout=pipe, text=True
        )
        assert self._process.stdout is not None and self._process.stdout.readline() == "loaded\n"

    def run(self, code: str, folder: Path) -> tuple[str, str]:
        """Run code in a folder; return what it wrote to its standard output and error."""
        self._count += 1
        said = [self._folder / f"{self._count}.{stream}" for stream in ("out", "err")]
        asked = {"code": code, "folder": str(folder), "said": [str(file) for file in said]}
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(f"{json.dumps(asked)}\n")
        self._process.stdin.flush()
        status = self._process.stdout.readline()
        out, err = (file.read_text(encoding="utf-8") for file in said)
        assert status == "0\n", err
        return out, err

    def close(self) -> None:
        """End it."""
        self._process.communicate()
