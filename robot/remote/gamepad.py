"""Gamepad of this computer, through evdev: an extra, only on Linux."""

from collections.abc import Callable
from typing import Any, NamedTuple

from gazerig.drivers.errors import DriverError, SetupError, extra_hint
from gazerig.robot.remote.steering import STOP, Stick

# Codes of the kernel's input-event-codes.h.
_KEY, _ABS = 0x01, 0x03
_X, _Y, _HAT_X, _HAT_Y = 0x00, 0x01, 0x10, 0x11
_SOUTH, _EAST, _NORTH, _WEST, _LEFT_SHOULDER, _START = 0x130, 0x131, 0x133, 0x134, 0x136, 0x13B

BUTTONS = {
    _SOUTH: "nod", _EAST: "shake", _WEST: "wink", _NORTH: "surprised", _LEFT_SHOULDER: "sleepy",
    _START: STOP,
}  # fmt: skip
"""Code of a button -> track or ``STOP``."""


class GamepadLost(DriverError):
    """The gamepad is unplugged or its battery is empty."""


class GamepadInput(NamedTuple):
    """Position of a gamepad's stick, and the actions of the buttons pressed since the last call."""

    stick: Stick
    pressed: tuple[str, ...]


def load_evdev() -> Any:
    """Import evdev and return the module.

    Raises:
        SetupError: evdev is not installed, or the system is not Linux.
    """
    try:
        import evdev
    except ImportError as error:
        raise SetupError(extra_hint("evdev", "gamepad", error)) from error
    return evdev


def open_gamepad(path: str | None, load: Callable[[], Any] = load_evdev) -> "Gamepad":
    """Open the first gamepad found, or the one at a path.

    Raises:
        SetupError: no gamepad is found, or it may not be read.
    """
    evdev = load()
    try:
        found = [evdev.InputDevice(one) for one in ([path] if path else evdev.list_devices())]
    except OSError as error:
        raise SetupError(
            f"{path}: {error.strerror or error}; gamepads are /dev/input/event*"
        ) from None
    pads = [one for one in found if _SOUTH in one.capabilities().get(_KEY, ())]
    for other in found:
        if other not in pads[:1]:
            other.close()
    if pads:
        return Gamepad(pads[0])
    where = (
        f"{path} is not a gamepad" if path else "no gamepad is connected, or you may not read it"
    )
    raise SetupError(f"{where}: plug one in; sudo usermod -aG input $USER, then log out and in")


class Gamepad:
    """Gamepad, read without waiting.

    Args:
        device: evdev.InputDevice or an object with its methods.
    """

    def __init__(self, device: Any) -> None:
        self._device = device
        self.name = str(device.name)
        axes = dict(device.capabilities().get(_ABS, ()))
        self._ranges = {
            code: (axes[code].min, axes[code].max)
            for code in (_X, _Y, _HAT_X, _HAT_Y)
            if code in axes
        }
        self._at = dict.fromkeys((_X, _Y, _HAT_X, _HAT_Y), 0.0)

    def news(self) -> GamepadInput:
        """Return the stick's position and the buttons pressed since the last call.

        Raises:
            GamepadLost: the gamepad is gone.
        """
        pressed = []
        try:
            for event in iter(self._device.read_one, None):
                if event.type == _KEY and event.value == 1 and event.code in BUTTONS:
                    pressed.append(BUTTONS[event.code])
                elif event.type == _ABS and event.code in self._ranges:
                    self._at[event.code] = self._share(event.code, event.value)
        except OSError:
            raise GamepadLost(f"{self.name} is gone: plug it in and start again") from None
        x, y = (self._at[hat] or self._at[axis] for hat, axis in ((_HAT_X, _X), (_HAT_Y, _Y)))
        return GamepadInput(Stick(x, -y), tuple(pressed))

    def close(self) -> None:
        """Close the device."""
        self._device.close()

    def _share(self, code: int, value: int) -> float:
        """Return an axis' position, -1..1."""
        low, high = self._ranges[code]
        return max(-1.0, min(1.0, 2.0 * (value - low) / (high - low) - 1.0)) if high > low else 0.0
