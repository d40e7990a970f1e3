"""Function calls in another process: rig files are read and written while a control loop runs.

Reading a rig takes 130 ms of pure Python. In another thread of the loop's process, ticks then took
up to 90 ms instead of 1 ms, because the loop waited for the interpreter lock after every answer of
a servo. In another process it has no measurable effect on the loop.
"""

import logging
import os
import pickle
import subprocess
import sys
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

from gazerig.config.load import ConfigError, ConfigFault
from gazerig.drivers.process import child_process

P = ParamSpec("P")
T = TypeVar("T")

_LOG = logging.getLogger("gazerig.config")
_LONGEST_S = 30.0
_MODULE = "gazerig.robot.run.subprocess_call"


def in_subprocess(work: Callable[P, T], /, *words: P.args, **named: P.kwargs) -> T:
    """Return the result of ``work``, a module's function, called in another process.

    ``in_subprocess(load_rig, "my.yaml", "shy")`` takes half a second, during which this process's
    interpreter is free. Paths have the same meaning there; arguments and results are copied.

    Raises:
        gazerig.config.load.ConfigError: as from ``work``, or the process failed.
    """
    try:
        done = child_process.run(_MODULE, pickle.dumps((work, words, named)), _LONGEST_S)
    except subprocess.TimeoutExpired:
        raise _failed(work, f"took more than {_LONGEST_S:g} s; check the disk") from None
    except OSError as error:
        raise _failed(work, f"cannot be started: {error.strerror}") from None
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().splitlines()[-1:]
        raise _failed(work, f"ended unexpectedly: {' '.join(last) or done.returncode}")
    for line in done.stderr.decode(errors="replace").splitlines():
        _LOG.warning("%s", line)
    value, faults = pickle.loads(done.stdout)
    if faults:
        raise ConfigError(faults)
    result: T = value
    return result


def serve() -> None:
    """Run in the other process: read one call from standard input and write its result."""
    os.nice(5)  # processes that wait for servos have priority
    work, words, named = pickle.load(sys.stdin.buffer)
    pickle.dump(_outcome(work, words, named), sys.stdout.buffer)


def _outcome(
    work: Callable[..., Any], words: tuple[Any, ...], named: dict[str, Any]
) -> tuple[Any, tuple[ConfigFault, ...]]:
    try:
        return work(*words, **named), ()
    except ConfigError as error:
        return None, error.faults


def _failed(work: Callable[..., Any], rule: str) -> ConfigError:
    return ConfigError([ConfigFault(f"process for {work.__name__}", None, "", rule)])


if __name__ == "__main__":
    serve()
