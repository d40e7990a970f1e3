"""Values and protocols of the drivers.

A servo bus speaks its servos' own steps (Dynamixel, Feetech STS: 4096 a turn, 0.088 deg;
a hobby servo on a Maestro: a quarter of a microsecond of pulse width); what a step means
at a joint is known by gazerig.robot.control.body alone. Times are host monotonic seconds.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan
from typing import Final, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics

ImageArray = NDArray[np.uint8]
"""(height, width, 3) BGR."""
Pixels = NDArray[np.float64]
"""(n, 2) x right, y down."""
Depth = NDArray[np.float32]
"""(height, width) metres along the optical axis, NaN where unknown."""
_Row = tuple[float, float, float]


class Feedback(NamedTuple):
    """Feedback of all servos of a bus in one exchange: a column a quantity, a value a servo.

    All columns are in the order of the setups. A servo without a fresh answer has NaN for
    position, velocity and load, and -inf for time: none of it is new.

    position_steps: present position, a whole number of steps
    velocity_steps_s: present velocity
    load: share of the stall torque that it gives, signed, -1..1
    at_s: host time at which the answer arrived

    What follows may be some cycles old, as it is read in turn:

    temperature_c, voltage_v: None before they were read first
    torque: whether the torque is on
    fault: latched hardware errors as text, "overload and input voltage"; "" where none

    measured: False if the servo has no feedback and position and velocity are its goal moved
        at its known speed
    rearmed: True in the first answer after the torque came on again with the present
        position as goal (a restarted servo, a port that was unplugged), and in every answer
        of a servo on its slow way into its limits: new plans must begin there
    missing: indices of the servos without a fresh answer, rising
    """

    position_steps: tuple[float, ...]
    velocity_steps_s: tuple[float, ...]
    load: tuple[float, ...]
    at_s: tuple[float, ...]
    temperature_c: tuple[float | None, ...]
    voltage_v: tuple[float | None, ...]
    torque: tuple[bool, ...]
    fault: tuple[str, ...]
    measured: tuple[bool, ...]
    rearmed: tuple[bool, ...]
    missing: tuple[int, ...]

    @classmethod
    def of_none(cls, count: int) -> "Feedback":
        """Return the feedback of an exchange in which no servo has answered."""
        unknown, never, no = (nan,) * count, (-inf,) * count, (False,) * count
        return cls(
            unknown, unknown, unknown, never, (None,) * count, (None,) * count, no,
            ("",) * count, (True,) * count, no, tuple(range(count)),
        )  # fmt: skip

    def filled(self, last: "Feedback") -> "Feedback":
        """Return the same with last values, of their own age, for servos without a fresh answer."""
        gone = frozenset(self.missing)
        columns = (
            tuple([old if i in gone else new for i, (old, new) in enumerate(both)])
            for both in (zip(*pair, strict=True) for pair in zip(last[:9], self[:9], strict=True))
        )
        return Feedback._make((*columns, self.rearmed, self.missing))


class BusHealth(NamedTuple):
    """Counts since open: bytes sent and received, and errors by kind."""

    tx_bytes: int
    rx_bytes: int
    errors: Mapping[str, int]


class ServoConfig(NamedTuple):
    """Configuration of one servo on a bus.

    model: name as in the control table, e.g. "xl330-m077"
    min_steps, max_steps: no goal outside is ever sent
    max_speed_steps_s: armed in the servo's own profile
    name: its joint, e.g. "neck_yaw", for messages; "" where it has no name
    firmware_min: oldest firmware that will do
    gains: the servo's P, I and D of position (Dynamixel: registers 84, 82, 80; STS: 21, 23,
        22), None where they stay as they are
    strength: share of full drive that it may use (Dynamixel: PWM Limit (36); STS: Torque
        Limit (48)), None where it stays as it is
    max_accel_steps_s2: armed in the servo's own profile where its kind has one beside goals
        that are planned already (Maestro); None: unlimited
    rest_steps: where a servo that cannot tell its position is taken to be when its pulses
        begin: its place before torque went off; None where it is not needed
    own_speed_steps_s: how fast such a servo itself moves, from its data sheet; None: as fast
        as max_speed_steps_s
    entry_speed_steps_s: how fast it is led into its limits from outside; None: 30 deg/s of
        its own shaft
    """

    id: int
    model: str
    min_steps: int
    max_steps: int
    max_speed_steps_s: float
    name: str = ""
    firmware_min: int = 0
    gains: tuple[int, int, int] | None = None
    strength: float | None = None
    max_accel_steps_s2: float | None = None
    rest_steps: int | None = None
    own_speed_steps_s: float | None = None
    entry_speed_steps_s: float | None = None

    def label(self, noun: str = "servo") -> str:
        """Return its label for messages: its joint and id, or its id alone."""
        return f"{self.name} ({noun} {self.id})" if self.name else f"{noun} {self.id}"


class ServoBus(Protocol):
    """A chain of servos; all sequences are in the order of the setups it was made with."""

    def open(self) -> None:
        """Open the port, find every servo, check and prepare it; torque stays off.

        Raises:
            PortError: the port cannot be opened.
            ServoMissing: servos are absent or of another model.
        """
        ...

    def read(self, now_s: float) -> Feedback:
        """Read all servos in one exchange.

        While the port is gone all servos are missing and the port is tried again now and then;
        when it is back the servos hold where they are, marked ``rearmed``.

        Raises:
            BusLost: no servo has answered for longer than ``give_up_s``.
        """
        ...

    def enable_torque(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then torque on.

        Returns the goals that are now in force, in steps.
        """
        ...

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits."""
        ...

    def faults(self) -> tuple[str, ...]:
        """Name every latched servo fault found so far, e.g. "servo 7: overload"."""
        ...

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call, e.g. "servo 3 restarted: set up again"."""
        ...

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Set the servos up so when the torque comes on the next time; the same ids and models."""
        ...

    def disable_torque(self) -> None:
        """Torque off on every servo; never raises for a servo that does not answer."""
        ...

    def health(self) -> BusHealth:
        """Return byte and error counts."""
        ...

    def close(self) -> None:
        """Close the port."""
        ...


class Clothing(NamedTuple):
    """Colours of the clothes below a head, as gazerig.drivers.vision.clothing finds them.

    colours: roots of the shares of 24 bins of colour; the inner product of two is their
        Bhattacharyya coefficient, 1 where they are the same
    share: of the place that counts, how much of it is seen, 0..1
    """

    colours: tuple[float, ...]
    share: float


class FaceSigns(NamedTuple):
    """What eyes and mouth of a face do, at an adult's size.

    eye_opening: of the lids, over the usual opening, 0 is shut; None where lids are not seen
    mouth_opening_m: gap between the lips
    """

    eye_opening: float | None
    mouth_opening_m: float


class DetectionInCamera(NamedTuple):
    """One detection with its place in the camera's axes (x right, y down, z forward).

    All of it follows from the image and the calibration alone.

    R_camera_face: axes of a face, None of anything else
    confidence: 0..1
    face_length: of a face, in lengths of the canonical one
    depth_measured: whether the distance was measured by the camera; else a face's is from
        its size and a thing's is assumed
    across_sd_m, along_sd_m: standard deviations of the place, across and along the view
    v_camera_m_s: velocity over ground, None where only the place is known;
        across_sd_m_s, along_sd_m_s: its standard deviations
    size_depth: of a face, its distance if it were of an adult's size, over the distance
        measured; None where the camera measured none
    mark: the detector's own number of it, None where it gives none
    turn_sd_rad: of a face, standard deviation of its turn
    gaze_camera: of a face, unit vector along which the eyes look, None where it is unknown
    fastest_m, fastest_m_s: of what moves, place and velocity of its fastest part, None where
        they are not known
    signs: of a face, what eyes and mouth do, None where they are not found
    upper_m: of what moves and is upright, place of its upper end, where a person's head is
    compact: of what moves, whether its patch is about as wide as high and full, as a fist's or a
        hand's alone is and an arm's is not
    thickness_m: of what moves, diameter of the largest disc within its patch, as far away as its
        place; from_side: the patch goes on beyond the left or right edge of the image
    clothing: of a person, colours of the clothes, None where they are not seen
    box_m: of a face, size of its box as far away as its place, the root of its area
    lower_face: of a face, width of the mouth over the distance of the eyes, times the part of the
        way from the eyes to the mouth at which the nose is; 0 of anything else
    """

    kind: str
    p_camera_m: tuple[float, float, float]
    R_camera_face: tuple[_Row, _Row, _Row] | None
    radius_m: float
    spin_rad_s: float
    confidence: float
    face_length: float
    depth_measured: bool
    across_sd_m: float
    along_sd_m: float
    v_camera_m_s: tuple[float, float, float] | None
    across_sd_m_s: float
    along_sd_m_s: float
    size_depth: float | None
    mark: int | None
    turn_sd_rad: float = 0.0
    gaze_camera: tuple[float, float, float] | None = None
    fastest_m: tuple[float, float, float] | None = None
    fastest_m_s: tuple[float, float, float] | None = None
    signs: FaceSigns | None = None
    compact: bool = False
    thickness_m: float = 0.0
    from_side: bool = False
    upper_m: tuple[float, float, float] | None = None
    clothing: Clothing | None = None
    box_m: float = 0.0
    lower_face: float = 0.0


class LocatedFrame(NamedTuple):
    """What one image shows, located in the camera's axes by one calibration.

    intrinsics: the calibration; things: what moves, with a place
    faces: behind those seen, the heads of people whose face is not; they have no ``R_camera_face``
    palms: of the nearest person, None in a frame that was not searched for them
    """

    intrinsics: Intrinsics
    faces: tuple[DetectionInCamera, ...]
    things: tuple[DetectionInCamera, ...]
    palms: tuple[DetectionInCamera, ...] | None = None


class FaceMesh(NamedTuple):
    """A dense mesh of a face in an image.

    points: (468, 3) points of MediaPipe's face mesh: x and y in pixels, and z in the same scale,
        smaller towards the camera
    irises_px: (2, 5, 2) of the right and the left iris (the owner's): its middle, then four of its
        edge; None where the eyes are too small
    lids_px: (2, 16, 2) contours of the same eyes: nine points along the lower lid, from corner to
        corner, and seven along the upper one; None with irises_px
    certainty: that there is a face, 0..1
    """

    points: NDArray[np.float32]
    irises_px: NDArray[np.float32] | None
    lids_px: NDArray[np.float32] | None
    certainty: float


@dataclass(frozen=True, slots=True)
class DetectedFace:
    """A face in a image.

    box_px: x, y, width, height
    landmarks_px: (5, 2): right eye, left eye, nose tip, right and left mouth corner;
        left and right are the owner's (the right eye lies left in the image)
    confidence: 0..1
    gaze_camera: unit vector along which the eyes look, in the camera frame (x right, y down,
        z forward); None where the detector does not find it
    mesh: its dense mesh, None where none was made
    clothing: colours of the clothes below it, None where they were not looked at or are not seen
    """

    box_px: tuple[float, float, float, float]
    landmarks_px: Pixels
    confidence: float
    gaze_camera: tuple[float, float, float] | None = None
    mesh: FaceMesh | None = None
    clothing: Clothing | None = None


@dataclass(frozen=True, slots=True)
class DetectedPerson:
    """A person in an image, whose face need not be visible.

    box_px: x, y, width, height of the body from the top of the head to the hips, which may be
        below the image
    head_px: middle of the head
    trunk_px: distance from the hips to the top of the head
    confidence: 0..1
    clothing: as of a face
    """

    box_px: tuple[float, float, float, float]
    head_px: tuple[float, float]
    trunk_px: float
    confidence: float
    clothing: Clothing | None = None


@dataclass(frozen=True, slots=True)
class DetectedPalm:
    """A palm or the back of a hand in an image.

    centre_px: middle between the wrist and the root of the middle finger
    size_px: distance of these two, as if the palm faced the camera
    confidence: 0..1
    """

    centre_px: tuple[float, float]
    size_px: float
    confidence: float


@dataclass(frozen=True, slots=True)
class MovingBlob:
    """Something that moves, with its place in the camera frame (x right, y down, z forward).

    id: identity given by the detector, stable from image to image
    kind: "hand", "thing", ...
    spin_rad_s: rotation about the line of view, clockwise in the image above 0
    loom_1_s: growth of its image in parts of its size; above 0 it comes nearer

    What follows is at its default where the detector does not measure it:

    v_camera_m_s: velocity over ground (the camera's own motion is out), along the camera's
        axes at the capture; None where only the places are known
    depth_known: the distance was measured; else it is assumed and depth_sd_m is large
    depth_sd_m, spin_sd_rad_s, loom_sd_1_s: standard deviations
    box_px: x, y, width, height; centre_px: a point on it; area_px: how much of the image
        it covers; flow_px_s: its mean motion, the camera's own taken out
    fastest_m, fastest_m_s: place and velocity of the quarter of it that moves fastest, as
        ``p_camera_m`` and ``v_camera_m_s``: of an arm, the hand
    thickness_m: diameter of the largest disc within it, as far away as ``p_camera_m``: of an arm,
        about the width of its hand; from_side: it goes on beyond the left or right edge
    """

    id: int
    kind: str
    p_camera_m: tuple[float, float, float]
    radius_m: float
    spin_rad_s: float = 0.0
    loom_1_s: float = 0.0
    v_camera_m_s: tuple[float, float, float] | None = None
    depth_known: bool = True
    depth_sd_m: float = 0.0
    spin_sd_rad_s: float = 0.0
    loom_sd_1_s: float = 0.0
    box_px: tuple[float, float, float, float] | None = None
    centre_px: tuple[float, float] | None = None
    area_px: float = 0.0
    flow_px_s: tuple[float, float] = (0.0, 0.0)
    fastest_m: tuple[float, float, float] | None = None
    fastest_m_s: tuple[float, float, float] | None = None
    thickness_m: float = 0.0
    from_side: bool = False


class CameraTurn(NamedTuple):
    """How a camera was turned when an image was exposed, by its own gyro.

    epoch: orientations of one epoch can be compared; a gap in the readings begins another
    R_start_camera: takes directions from the camera's axes (x right, y down, z forward) to those
        it had as the epoch began; drifts slowly
    """

    epoch: int
    R_start_camera: tuple[_Row, _Row, _Row]

    @property
    def is_rotation(self) -> bool:
        """Return whether its rows are those of a rotation; False of NaN too."""
        R = np.array(self.R_start_camera, dtype=np.float64)
        return R.shape == (3, 3) and bool(np.abs(R @ R.T - np.eye(3)).max() < 1e-3)

    def since(self, before: "CameraTurn | None") -> NDArray[np.float64] | None:
        """Return R_now_before (3, 3), which turns directions in camera axes; None where unknown."""
        if before is None or before.epoch != self.epoch:
            return None
        return np.asarray(np.array(self.R_start_camera).T @ np.array(before.R_start_camera))


SCENES_OF_A_PROCESS: Final = 1_000_000
"""Scenes that a camera's process counts; those of the one started after it are numbered from so
many on."""


@dataclass(frozen=True, slots=True)
class Detections:
    """What was found in one image.

    captured_s: host time of the exposure; number: counts images from 1
    image: the BGR image itself where there is one (never written to after this)
    depth_m: distances seen from where the image was taken, where the camera measures
        them: (height_px, width_px), NaN where unknown
    lens: the lens if the camera reports it
    located: faces and things in the camera's axes; None: whoever needs them computes them
    turn: how the camera was turned by its own gyro, None where it has none
    scene: counts the scenes that were shown: another one than before, and there was a cut
    people: with and without a visible face; only some frames are searched for them, and of each
        only a part
    palms: of the nearest person, None in a frame that was not searched for them
    conditions: under which the camera sees badly, each with its remedy
    """

    captured_s: float
    number: int
    width_px: int
    height_px: int
    faces: tuple[DetectedFace, ...] = ()
    blobs: tuple[MovingBlob, ...] = ()
    image: ImageArray | None = None
    depth_m: Depth | None = None
    lens: Intrinsics | None = None
    located: LocatedFrame | None = None
    turn: CameraTurn | None = None
    scene: int = 0
    people: tuple[DetectedPerson, ...] = ()
    palms: tuple[DetectedPalm, ...] | None = None
    conditions: tuple[str, ...] = ()

    def located_by(self, locate: "Callable[[Detections], LocatedFrame] | None") -> "Detections":
        """Return the same with what it shows located in the camera's axes; None: as it is."""
        if locate is None:
            return self
        return Detections(
            self.captured_s,
            self.number,
            self.width_px,
            self.height_px,
            self.faces,
            self.blobs,
            self.image,
            self.depth_m,
            self.lens,
            locate(self),
            self.turn,
            self.scene,
            self.people,
            self.palms,
            self.conditions,
        )


class Camera(Protocol):
    """A source of detections. The newest is a value in a slot: nothing queues, nothing blocks."""

    def open(self) -> None:
        """Start looking.

        Raises:
            CameraError: it cannot; the message names the device and the remedy.
        """
        ...

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections available at ``now_s``, or None before the first.

        Raises:
            CameraError: the source has failed for good.
        """
        ...

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call, e.g. "camera lost: trying it again"."""
        ...

    def close(self) -> None:
        """Stop and free the source; safe to call twice."""
        ...


class FaceDetector(Protocol):
    """Finds faces in one image; pure but for the network's own memory."""

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Find faces, the largest first, in pixels of the image given."""
        ...
