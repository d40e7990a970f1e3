"""Errors of the drivers, grouped by what the caller can do about them."""

from gazerig.errors import Error


class DriverError(Error):
    """Base; the message is one line that names the thing and the remedy."""


class SetupError(DriverError):
    """A person must change something before a start can succeed."""


class PortError(SetupError):
    """The serial port is absent, busy or not permitted."""


class ServoMissing(SetupError):
    """Servos do not answer or do not match the configuration."""


class CameraError(SetupError):
    """The camera or file is absent, unreadable or busy."""


class ModelFileError(SetupError):
    """A detector's model file is missing or damaged."""


class PluginError(SetupError):
    """A plug-in cannot be used; the message names the part, the package and its version."""


class BusLost(DriverError):
    """The port was lost in use: nothing may move until it is reopened and the servos are read."""


class ServoFault(DriverError):
    """A servo has latched a hardware error: stop, park the servos that still move, report it."""


def extra_hint(package: str, extra: str, error: ImportError) -> str:
    """Return in one line why a package cannot be used, and the command that installs it.

    Args:
        package: Package that could not be imported, e.g. "depthai".
        extra: Extra of gazerig that includes it, e.g. "oak".
        error: Error that the import raised.
    """
    absent = isinstance(error, ModuleNotFoundError) and error.name == package.replace("-", "_")
    reason = "is not installed" if absent else f"cannot be loaded ({' '.join(str(error).split())})"
    return f"{package} {reason}: pip install 'gazerig[{extra}]'"
