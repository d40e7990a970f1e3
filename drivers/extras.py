"""Optional packages, installed as extras of this one."""


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
