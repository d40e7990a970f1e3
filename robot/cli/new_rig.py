"""Text of a new rig's file: the shortest working one, from a few answers. Pure."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from gazerig.config.save_text import format_value

BOARDS: Mapping[str, str] = {
    "dynamixel": "Dynamixel servos on a U2D2, an OpenRB-150 or another adaptor",
    "feetech": "Feetech STS servos on their adaptor",
    "maestro": "hobby servos on a Pololu Maestro",
    "pca9685": "hobby servos on a PCA9685 board, over I2C",
    "none": "no board yet: emulated servos",
}
"""Boards of servos, with their descriptions."""

CAMERAS: Mapping[str, str] = {
    "webcam": "a webcam",
    "oak": "an OAK-D",
    "none": "no camera yet: a simulated visitor",
}
"""Cameras, with their descriptions."""

_EYES = ("eyes_pan", "eyes_tilt")
_BOTH_EYES = ("left_eye_pan", "left_eye_tilt", "right_eye_pan", "right_eye_tilt")
_UPPER = ("left_upper_lid", "right_upper_lid")
_LOWER = ("left_lower_lid", "right_lower_lid")
_NECK = ("neck_yaw", "neck_pitch", "neck_roll")


class Mechanism(NamedTuple):
    """A common mechanism: its description, and its joints, one servo each."""

    summary: str
    joints: tuple[str, ...]


MECHANISMS: Mapping[str, Mechanism] = {
    "eyes": Mechanism("two servos: one turns both eyes left and right, one up and down", _EYES),
    "eyes-lids": Mechanism("six: the same, and four lids", (*_EYES, *_UPPER, *_LOWER)),
    "two-eyes": Mechanism("six: each eye separately, two upper lids", (*_BOTH_EYES, *_UPPER)),
    "head": Mechanism("nine: the same, and a neck", (*_BOTH_EYES, *_UPPER, *_NECK)),
}
"""Mechanisms by the name for ``gazerig new --joints``, which also accepts names of joints."""


@dataclass(frozen=True)
class NewRig:
    """The rig to write.

    board, camera: keys of BOARDS and CAMERAS
    joints: names, in the order of their ids
    eyes_mm: distance between the eye centres
    port: serial port or I2C bus; empty: the usual one of the board
    """

    name: str
    board: str
    joints: tuple[str, ...]
    camera: str
    eyes_mm: float = 62.0
    port: str = ""

    @property
    def has_neck(self) -> bool:
        """Return whether a neck turns the head."""
        return any(name in _NECK for name in self.joints)


class _Servo(NamedTuple):
    """Drive of a joint: its servo model, its function, and further settings in its line."""

    model: str
    speed_deg_s: int
    accel_deg_s2: int
    further_settings: str = ""


class _Board(NamedTuple):
    """Properties of a board.

    port: its usual port; first_id: usual first id of its servos
    eye, lid, neck: drives of the joints; gaze: settings for servos slower than the fastest ones
    """

    port: str
    bus: str
    first_id: int
    id_comment: str
    eye: _Servo
    lid: _Servo
    neck: _Servo
    gaze: tuple[str, ...] = ()


_NECKLESS_GAZE = "idle: {reach_deg: 28}"
"""Idle gaze without a neck goes no farther than the eyes alone can turn."""
_HOBBY = "servo_speed_deg_s: 600"
_HOBBY_GAZE = (
    "saccade: {max_speed_deg_s: 380}",
    "oculomotor: {eye_lag_ms: 35, refixations: false}",
    "lids: {close_ms: 170, open_ms: 260}",
)
_DYNAMIXEL = _Board(
    "/dev/ttyUSB0", "kind: dynamixel", 1, "the servo's id",
    _Servo("xl330-m077", 600, 45000, "gains: [1200, 0, 12000]"),
    _Servo("xl330-m077", 1200, 60000, "gains: [700, 0, 5500]"),
    _Servo("xc330-m288", 200, 2000, "gains: [2000, 0, 14000]"),
)  # fmt: skip
_TABLE: Mapping[str, _Board] = {
    "dynamixel": _DYNAMIXEL,
    "none": _DYNAMIXEL,
    "feetech": _Board(
        "/dev/ttyACM0", "kind: feetech", 1, "the servo's id",
        _Servo("sts3215", 300, 15000, "gains: [48, 0, 64]"),
        _Servo("sts3215", 300, 15000, "gains: [32, 0, 64]"),
        _Servo("sts3215", 180, 1500, "gains: [32, 0, 64]"),
        ("saccade: {max_speed_deg_s: 260, max_acceleration_deg_s2: 5400}",
         "oculomotor: {eye_lag_ms: 15}", "lids: {close_ms: 290, open_ms: 400}"),
    ),
    "maestro": _Board(
        "/dev/ttyACM0", "kind: maestro", 0, "the board's channel",
        _Servo("hobby", 420, 30000, _HOBBY), _Servo("hobby", 500, 40000, _HOBBY),
        _Servo("hobby", 120, 1000, _HOBBY), _HOBBY_GAZE,
    ),
    "pca9685": _Board(
        "/dev/i2c-1", "kind: pca9685", 0, "the board's channel",
        _Servo("hobby", 420, 30000, _HOBBY), _Servo("hobby", 500, 40000, _HOBBY),
        _Servo("hobby", 120, 1000, _HOBBY), _HOBBY_GAZE,
    ),
}  # fmt: skip

_PAN_DEG, _TILT_DEG, _UPPER_DEG, _LOWER_DEG, _OTHER_DEG = 35, 30, (-30, 25), (-10, 25), 30
_NECK_DEG = {"neck_yaw": 70, "neck_pitch": 35, "neck_roll": 25}
_HOBBY_TILT_DEG = 22
_UPPER_ENDS, _LOWER_ENDS = (-25, 20), (-8, 20)
_MIRRORED = ("right_eye_tilt", *_UPPER[1:], *_LOWER[1:])
"""Joints whose servo is mounted mirrored to that on the left."""


def rig_text(new: NewRig) -> str:
    """Return the YAML of a rig.

    Raises:
        KeyError: there is no such board or camera.
    """
    return "".join(f"{line}\n" for line in _lines(new, _TABLE[new.board], new.camera))


def usual_port(board: str) -> str:
    """Return the usual port of a board."""
    return _TABLE[board].port


def joints_of(text: str) -> tuple[str, ...]:
    """Return the joints of a mechanism's name, or of joint names separated by commas."""
    if text in MECHANISMS:
        return MECHANISMS[text].joints
    return tuple(name for word in text.split(",") if (name := word.strip()))


def _lines(new: NewRig, board: _Board, camera: str) -> Iterator[str]:
    there = "no board yet: only with --mock" if new.board == "none" else "`gazerig scan` lists it"
    yield f"# A head of {len(new.joints)} servos. The shipped rig desk.yaml explains the keys."
    yield f"name: {format_value(new.name)}"
    yield "profile: robot"
    yield f"bus: {{{board.bus}, port: {format_value(new.port or board.port)}}}  # port: {there}"
    yield "# Measure in mm: the eyes' centres ahead of and above the neck's pitch axis (or the table)."
    height, ahead, above = (70, 38, 55) if new.has_neck else (0, 0, 90)
    yield "geometry:"
    yield (
        f"  {{pitch_axis_height_mm: {height}, eyes_ahead_mm: {ahead}, eyes_above_mm: {above}, "
        f"interocular_mm: {new.eyes_mm:g}}}"
    )
    yield f"joints:  # id: {board.id_comment}; `gazerig calibrate` measures zero, sign and range of each"
    for number, name in enumerate(new.joints):
        yield f"  {name}: {{id: {board.first_id + number}, {_joint(name, board)}}}"
    yield from _lids_and_park(new.joints)
    yield from _camera_lines(new, camera)
    gaze = list(board.gaze)
    if "neck_yaw" not in new.joints:
        gaze.append(_NECKLESS_GAZE)
    if gaze:
        yield "gaze:  # differences from a head with a neck and fast servos"
        yield from (f"  {line}" for line in gaze)


def _lids_and_park(joints: tuple[str, ...]) -> Iterator[str]:
    """Return the shut and open angles of the lids, and the pose before torque is switched off."""
    lids = [name for name in joints if name in (*_UPPER, *_LOWER)]
    if lids:
        yield "lid_joints:  # each lid shut and fully open"
        for name in lids:
            shut, wide = _lid_ends_deg(name)
            key = name.removesuffix("_lid").removesuffix("_upper")
            yield f"  {key}_deg: [{shut}, {wide}]"
    park = [f"{name}: {_lid_ends_deg(name)[0]}" for name in lids]
    if "neck_pitch" in joints:
        park = ["neck_pitch: -12", *park]
    if park:
        yield f"park_deg: {{{', '.join(park)}}}"


def _joint(name: str, board: _Board) -> str:
    """Return the settings in a joint's line after its id."""
    low, high = _range_deg(name, board)
    servo = board.eye
    if name.endswith("_lid"):
        servo = board.lid
    elif "eye" not in name:
        servo = board.neck
    parts = [
        f"model: {servo.model}", f"min_deg: {low}", f"max_deg: {high}",
        f"max_speed_deg_s: {servo.speed_deg_s}", f"max_accel_deg_s2: {servo.accel_deg_s2}",
        *(["sign: -1"] if name in _MIRRORED else []), servo.further_settings,
    ]  # fmt: skip
    return ", ".join(part for part in parts if part)


def _range_deg(name: str, board: _Board) -> tuple[int, int]:
    if name in _UPPER or name in _LOWER:
        return _UPPER_DEG if name in _UPPER else _LOWER_DEG
    if name.endswith("_tilt") and board.eye.model == "hobby":
        return -_HOBBY_TILT_DEG, _HOBBY_TILT_DEG
    way = {"pan": _PAN_DEG, "tilt": _TILT_DEG}.get(name.rpartition("_")[2], _OTHER_DEG)
    half = _NECK_DEG.get(name, way)
    return -half, half


def _lid_ends_deg(lid: str) -> tuple[int, int]:
    return _UPPER_ENDS if lid in _UPPER else _LOWER_ENDS


def _camera_lines(new: NewRig, camera: str) -> Iterator[str]:
    """Return the mount of the camera: on the head if a neck turns it, otherwise next to it."""
    if CAMERAS[camera] == CAMERAS["none"]:
        return
    where = ("head", "[20, 0, 45]") if new.has_neck else ("base", "[10, 0, 140]")
    field = 69 if camera == "oak" else 60
    yield "# position_mm: the lens ahead, left and above of " + (
        "the point between the eyes." if new.has_neck else "the point on the table below the eyes."
    )
    yield f"camera: {{mount: {where[0]}, position_mm: {where[1]}, horizontal_field_deg: {field}}}"
