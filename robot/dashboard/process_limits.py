"""What the page's process may take of the machine, which the control loop needs."""

import logging
import os
import resource

_NICENESS = 5  # the control loop comes first where both want the same core
_MOST_FILES = 8192  # a burst of connections must leave some


def limit_process() -> None:
    """Put this process behind the control loop, and bound what rubbish from outside costs."""
    os.nice(_NICENESS)
    least, most = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(least, min(_MOST_FILES, most)), most))
    # Standard error is kept in memory, and whoever sends rubbish would fill it with complaints.
    logging.disable(logging.CRITICAL)
