"""The one place where depthai is imported: only when asked for, and quietly.

depthai sends usage figures unless DEPTHAI_TELEMETRY is 0, and logs to the standard output,
which belongs to the output that the user asked for. Both are read at its import; the
environment variable DEPTHAI_LEVEL brings its log back.
"""

import os
from typing import Any

from gazerig.drivers.errors import CameraError
from gazerig.drivers.extras import extra_hint


def load_depthai() -> Any:
    """Import depthai and return the module.

    Raises:
        CameraError: it is not installed or does not start here.
    """
    os.environ["DEPTHAI_TELEMETRY"] = "0"
    os.environ.setdefault("DEPTHAI_LEVEL", "off")
    try:
        import depthai
    except ImportError as error:
        raise CameraError(extra_hint("depthai", "oak", error)) from error
    return depthai
