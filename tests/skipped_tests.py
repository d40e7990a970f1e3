"""One line for each group of skipped tests: how many, why, and how to enable them."""

import re
from collections import Counter
from collections.abc import Iterable

_GROUPS = (
    (r"chromium", "no browser in the path", "apt-get install chromium"),
    (r"[Mm]u[Jj]o[Cc]o|worlds need", "no MuJoCo", "pip install -e '.[world]'"),
    (r"OpenGL|renders", "no OpenGL without a screen", "apt-get install libegl1"),
    (r"bids-validator", "no BIDS validator", "pip install bids-validator-deno"),
    (r"[Ff]eature|gazerig\.features", "a folder of features/ is absent", "restore the folder"),
    (r"make test fetches|networks of face meshes", "no models", "make test with a network"),
    (r"superuser|root may|read everything", "root may open every file", "run the tests as a user"),
    (r"only root", "only root can play another user", "run the tests as root"),
    (r"systemd", "no systemd-analyze", "run on a system with systemd"),
    (r"photo|film|signer|\.(mp4|avi|webm|onnx)", "films and models that are not shipped", ""),
)
"""Reasons, in this order: a pattern, the group, and what enables its tests."""


def groups(reasons: Iterable[str]) -> list[str]:
    """Return a line for each group, the largest first.

    Args:
        reasons: why each test was skipped.
    """
    counts: Counter[tuple[str, str]] = Counter()
    for reason in reasons:
        said = reason.removeprefix("Skipped: ")
        known = (row[1:] for row in _GROUPS if re.search(row[0], said))
        counts[next(known, (said, ""))] += 1
    return [
        f"{count} skipped: {why}" + (f"; to enable: {remedy}" if remedy else "")
        for (why, remedy), count in counts.most_common()
    ]
