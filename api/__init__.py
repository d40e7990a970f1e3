"""Makes an animatronic head look at people the way people look at each other."""


def __getattr__(name: str) -> str:
    # Looking the version up takes longer than a short command may.
    if name == "__version__":
        from importlib.metadata import version

        return version("gazerig")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
