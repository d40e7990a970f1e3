"""Import of depthai, only on request and without its log.

depthai sends usage figures unless DEPTHAI_TELEMETRY is 0, and logs to the standard output, which
must contain only the requested output. It reads both settings at its import; the environment
variable DEPTHAI_LEVEL enables its log.
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
