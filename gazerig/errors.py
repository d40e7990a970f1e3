"""Errors that gazerig raises for its user to handle; messages are written for people.

Every part of the program may import this module; it needs the standard library only.
"""


class Error(Exception):
    """Base of all errors of gazerig; the message names the cause and the remedy."""


class NotFound(Error):
    """A requested object does not exist: a running rig, a person, a joint."""


class Refused(Error, ValueError):
    """A request breaks a rule; nothing was changed, and the message names the rule."""


class HeadEnded(Error):
    """The head has ended, or its program does not answer; the message gives the reason."""
