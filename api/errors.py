"""Everything that gazerig raises for its user to handle; each message is what a person reads.

Every part of the program may import this module; it stands on the standard library alone.
"""


class Error(Exception):
    """Base of all errors of gazerig; the message names the thing and the remedy."""


class NotFound(Error):
    """What is asked for is not there: a running rig, a person, a joint."""


class Refused(Error, ValueError):
    """What is asked for breaks a rule; nothing was changed, the message says which rule."""


class HeadEnded(Error):
    """The head has ended, or its program does not answer; the message says why."""
