"""Packages that are installed only when asked for, as extras of this one."""


def extra_hint(package: str, extra: str, error: ImportError) -> str:
    """Return one line that says why a package cannot be used, and the command that installs it.

    Args:
        package: What could not be imported, e.g. "depthai".
        extra: The extra of gazerig that brings it, e.g. "oak".
        error: What its import raised.
    """
    absent = isinstance(error, ModuleNotFoundError) and error.name == package.replace("-", "_")
    reason = "is not installed" if absent else f"cannot be loaded ({' '.join(str(error).split())})"
    return f"{package} {reason}: pip install 'gazerig[{extra}]'"
