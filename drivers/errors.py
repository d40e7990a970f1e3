"""Errors of the drivers, by what the caller can do about them."""

from gazerig.errors import Error


class DriverError(Error):
    """Base; the message is one line that names the thing and the remedy."""


class SetupError(DriverError):
    """Something must be changed by a person before a start can succeed."""


class PortError(SetupError):
    """The serial port is absent, busy or not permitted."""


class ServoMissing(SetupError):
    """Servos do not answer, or are not what the configuration says."""


class CameraError(SetupError):
    """The camera or file is absent, unreadable or busy."""


class ModelFileError(SetupError):
    """A detector's model file is missing or not what it should be."""


class PluginError(SetupError):
    """A part of a package cannot be used; the message names part, package and version."""


class BusLost(DriverError):
    """The port went away while in use: nothing may move until it is back and re-read."""


class ServoFault(DriverError):
    """A servo has latched a hardware error: stop, park what still moves, report it."""
