"""Servos written as text: ``1-6:xl330-m077,7:xc330-m288@1024`` (ids, model, start in steps)."""

import re

from gazerig.drivers.bus.servo_models import SERVOS, BusKind
from gazerig.drivers.errors import SetupError
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

EXAMPLE = "1-6:xl330-m077,7-9:xc330-m288"
MIDDLE = 2048

_PART = re.compile(r"(\d+)(?:-(\d+))?:([^@]+)(?:@(\d+))?")
_LINES: dict[BusKind, type[DynamixelLine | FeetechLine]] = {
    "dynamixel": DynamixelLine,
    "feetech": FeetechLine,
}
_HIGHEST_ID: dict[BusKind, int] = {"dynamixel": 252, "feetech": 253}
_MODELS = {name: facts.bus for name, facts in SERVOS.items() if facts.bus in _LINES}


def line_of(text: str, baud: int) -> DynamixelLine | FeetechLine:
    """Parse the servos of one line, such as ``1-6:sts3215`` or ``7:xc330-m288@1024``.

    Raises:
        SetupError: the text is invalid; the message names the wrong part and valid ones.
    """
    specs: dict[int, ServoSpec] = {}
    kind: BusKind | None = None
    for part in text.split(","):
        found = _PART.fullmatch(part.strip())
        if found is None:
            raise SetupError(f"--servos {part!r}: not IDS:MODEL, for example {EXAMPLE}")
        first, last = int(found[1]), int(found[2] or found[1])
        model, start = found[3].lower(), int(found[4] or MIDDLE)
        known = [name for name in _MODELS if kind in (None, _MODELS[name])]
        if model not in known:
            line = f"a line of kind {kind}" if kind else "a line"
            raise SetupError(f"--servos {part!r}: {line} has no such model, but {', '.join(known)}")
        kind = _MODELS[model]
        if not first <= last <= _HIGHEST_ID[kind]:
            raise SetupError(f"--servos {part!r}: ids must increase, from 0 to {_HIGHEST_ID[kind]}")
        for servo_id in range(first, last + 1):
            if servo_id in specs:
                raise SetupError(f"--servos {part!r}: id {servo_id} is taken; ids must differ")
            specs[servo_id] = ServoSpec(servo_id, model, start)
    assert kind is not None  # a text has a part
    return _LINES[kind](tuple(specs.values()), baud)
