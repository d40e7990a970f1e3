"""Servos written as text: ``1-6:xl330-m077,7:xc330-m288@1024`` (ids, model, start position)."""

import re
from collections.abc import Iterable

from gazerig.drivers.bus.servo_models import SERVOS, BusKind
from gazerig.drivers.errors import SetupError
from gazerig.sim_mock.devices import DynamixelLine, FeetechLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

EXAMPLE = "1-6:xl330-m077,7-9:xc330-m288"
MIDDLE = 2048
DEFAULT_FIRMWARE = ServoSpec(1, "").firmware

_PART = re.compile(r"(\d+)(?:-(\d+))?:([^@]+)(?:@(\d+))?")
_LINES: dict[BusKind, type[DynamixelLine | FeetechLine]] = {
    "dynamixel": DynamixelLine,
    "feetech": FeetechLine,
}
_SPEECH: dict[BusKind, str] = {"dynamixel": "speaks Dynamixel's", "feetech": "speaks Feetech's"}
_HIGHEST_ID: dict[BusKind, int] = {"dynamixel": 252, "feetech": 253}
_MODELS = [name for name, facts in SERVOS.items() if facts.bus in _LINES]


def line_of(text: str, firmware: int | None, baud: int) -> DynamixelLine | FeetechLine:
    """Parse the servos of one line; ``firmware``: of all servos, None: as delivered.

    Raises:
        SetupError: the text is invalid; the message names the wrong part and valid ones.
    """
    specs = parse_servos(text, DEFAULT_FIRMWARE if firmware is None else firmware)
    return _LINES[SERVOS[specs[0].model].bus](specs, baud)


def parse_servos(text: str, firmware: int) -> tuple[ServoSpec, ...]:
    """Parse servos such as ``1-6:sts3215`` or ``7:xc330-m288@1024`` (@: start in steps).

    Raises:
        SetupError: the text is invalid; the message names the wrong part and valid ones.
    """
    specs: dict[int, ServoSpec] = {}
    for part in text.split(","):
        found = _PART.fullmatch(part.strip())
        if found is None:
            raise SetupError(f"--servos {part!r}: not IDS:MODEL, for example {EXAMPLE}")
        first, last = int(found[1]), int(found[2] or found[1])
        model, start = found[3].lower(), int(found[4] or MIDDLE)
        if model in SERVOS and SERVOS[model].bus == "maestro":
            raise SetupError(f"--servos {part!r}: a hobby servo needs a board: --maestro 12")
        highest = _HIGHEST_ID[SERVOS[model].bus] if model in SERVOS else min(_HIGHEST_ID.values())
        if not first <= last <= highest:
            raise SetupError(f"--servos {part!r}: ids must increase, from 0 to {highest}")
        if model not in SERVOS:
            raise SetupError(
                f"--servos {part!r}: unknown model; known models: {', '.join(_MODELS)}"
            )
        for servo_id in range(first, last + 1):
            if servo_id in specs:
                raise SetupError(
                    f"--servos {part!r}: id {servo_id} is taken by a {specs[servo_id].model}; "
                    "ids must differ (the command `collide` makes a collision)"
                )
            specs[servo_id] = ServoSpec(servo_id, model, start, firmware)
    _require_one_kind(specs.values())
    return tuple(specs.values())


def _require_one_kind(specs: Iterable[ServoSpec]) -> None:
    """Reject servos of different protocols on one line."""
    one: dict[BusKind, ServoSpec] = {}
    for spec in specs:
        one.setdefault(SERVOS[spec.model].bus, spec)
    if len(one) > 1:
        named = [f"{s.model} (id {s.id}) {_SPEECH[kind]}" for kind, s in one.items()]
        raise SetupError(
            f"--servos: {' and '.join(named)}; one line carries one protocol: "
            "start a second `gazerig emulate`"
        )
