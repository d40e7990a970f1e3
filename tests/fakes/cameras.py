"""The part of a camera, or of a source of frames, that most tests do not care about."""


class QuietCamera:
    """Opens, closes and has no news; a subclass adds ``latest`` or ``take``."""

    number = 0

    def open(self) -> None: ...

    def events(self) -> tuple[str, ...]:
        return ()

    def close(self) -> None: ...
