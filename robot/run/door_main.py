"""Process of one door of a running rig; ``DoorProcesses`` starts it."""

import sys

from gazerig.drivers.process.visible_text import visible
from gazerig.errors import Error
from gazerig.robot.run.door_processes import DoorEntry, load_door


def main(text: str, pid: str) -> int:
    """Run a door until the rig's process ends.

    Args:
        text: Entry of the rig's key ``doors``.
        pid: Process id of the head.
    """
    try:
        entry = DoorEntry.parse(text)
        load_door(entry.name).run(int(pid), entry.address, entry.bind, _say, ends_with_input=True)
    except Error as error:
        _say(str(error))
        return 2
    return 0


def _say(line: str) -> None:
    sys.stderr.write(f"{visible(line)}\n")
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
