"""The process of a study's head: python -m gazerig.features.study.run.head_main.

Standard input: the options of the run as one line of JSON. It parks, switches the torque off and
ends when its input ends, so also when the study's program dies.
"""

import os
import signal
import sys
import threading

from gazerig.drivers.process.visible_text import visible
from gazerig.errors import Error
from gazerig.features.study.run.head_process import decode_options
from gazerig.robot.app import session

_ENDING = (signal.SIGTERM, signal.SIGHUP)


def main() -> int:
    """Run the head until the input ends; return the exit code."""
    ended: list[str] = []
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the study's program handles Ctrl-C
    for number in _ENDING:
        signal.signal(number, lambda *_: ended.append("a signal"))
    options = decode_options(sys.stdin.buffer.readline())

    def wait() -> None:
        while os.read(0, 4096):  # not through the buffer, whose lock the interpreter needs to exit
            pass
        ended.append("the end of the study's session")

    threading.Thread(target=wait, daemon=True).start()
    try:
        composed = session.compose(options)
        figures = session.run(
            composed, lambda: ended[0] if ended else None, _print_line, summarised=False
        )
    except Error as error:
        _print_line(str(error))
        return 1
    return 1 if str(figures["stopped_by"]).startswith("fault") else 0


def _print_line(line: str) -> None:
    sys.stderr.write(f"{visible(line)}\n")
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
