"""Errors of the drivers, grouped by the caller's possible reaction."""

from importlib.util import find_spec
from pathlib import Path

from gazerig.errors import Error

_CLONE = Path(__file__).resolve().parents[1]
"""Folder of the repository if the program runs from a clone of it."""


class DriverError(Error):
    """Base; the message is one line that names the faulty part and the remedy."""


class SetupError(DriverError):
    """The user must change something before a start can succeed."""


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
    return f"{package} {reason}: {install_command(extra)}"


def require_package(package: str, extra: str) -> None:
    """Check that a package of an extra is installed.

    Raises:
        SetupError: it is not; the message has the command that installs it.
    """
    if find_spec(package) is None:
        raise SetupError(extra_hint(package, extra, ModuleNotFoundError(name=package)))


def install_command(extra: str) -> str:
    """Return the command that installs an extra of gazerig: from the clone it runs from, if any."""
    if not (_CLONE / "pyproject.toml").is_file():
        return f"pip install 'gazerig[{extra}]'"
    return f"pip install -e '{'.' if Path.cwd() == _CLONE else _CLONE}[{extra}]'"
