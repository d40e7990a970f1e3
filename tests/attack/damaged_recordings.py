"""Damage recordings and use them: python tests/attack/damaged_recordings.py 20000.

Prints how many were refused with one line, gave the whole run, or its beginning with a note,
and every other outcome; with the longest and the memory that it took.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from recording_damage import USES, judge, recorded, with_bomb  # noqa: E402

from gazerig.drivers.errors import DriverError  # noqa: E402


def main(count: int, seed: int) -> int:
    """Return 1 where anything was neither refused nor right."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        data = recorded(folder / "run.mcap", 0.3)
        began = time.process_time()
        tally = judge(data, folder, count, seed, tuple(USES))
        print(f"{count} cases of a file of {len(data)} bytes, {time.process_time() - began:.0f} s:")
        print(f"refused {tally.refused}, right {tally.right}, partly, with a note {tally.partly}")
        print(f"wrong {len(tally.wrong)}", *tally.wrong[:40], sep="\n  ")
        through = 0
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for honest in (True, False):
            file = folder / "bomb.mcap"
            file.write_bytes(with_bomb(data, 3200 << 20, honest))
            try:
                USES["export"](file)
                through += 1
                print("a bomb went through")
            except DriverError as error:
                print(f"bomb of 3.2 GB in {file.stat().st_size} bytes: {error}")
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        print(f"memory before the bombs {before / 1e3:.0f} MB, most after {after / 1e3:.0f} MB")
    return 1 if tally.wrong or through else 0


if __name__ == "__main__":
    sys.exit(main(*(int(word) for word in (sys.argv[1:] + ["400", "0"][len(sys.argv) - 1 :]))))
