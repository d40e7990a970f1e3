"""Values and protocols of the drivers.

A servo bus uses its servos' own steps (Dynamixel, Feetech STS: 4096 per turn, 0.088 deg; a hobby
servo on a Maestro: a quarter of a microsecond of pulse width). Only gazerig.robot.loop.body
converts steps to joint angles. Times are host monotonic seconds.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
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
    """Feedback of all servos of a bus in one exchange: a column per quantity, a value per servo.

    All columns are in the order of the setups. A servo without a fresh answer has NaN for position,
    velocity and load, and -inf for time.

    position_steps: present position, a whole number of steps
    velocity_steps_s: present velocity
    load: torque as a share of the stall torque, signed, -1..1
    at_s: host time at which the answer arrived

    The following columns may be some cycles old, as the servos take turns:

    temperature_c, voltage_v: None before the first reading
    torque: whether the torque is on
    fault: latched hardware errors as text, "overload and input voltage"; "" for none

    measured: False if the servo has no feedback; position and velocity then follow its goal at its
        known speed
    rearmed: True in the first answer after the torque was switched on again with the present
        position as goal (a restarted servo, a port that was unplugged), and in every answer of a
        servo that moves slowly into its limits: new plans must begin there
    missing: indices of the servos without a fresh answer, ascending
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
    def create_missing(cls, count: int) -> "Feedback":
        """Return the feedback of an exchange in which no servo has answered."""
        unknown, never, no = (nan,) * count, (-inf,) * count, (False,) * count
        return cls(
            unknown, unknown, unknown, never, (None,) * count, (None,) * count, no,
            ("",) * count, (True,) * count, no, tuple(range(count)),
        )  # fmt: skip

    def fill_missing(self, last: "Feedback") -> "Feedback":
        """Return a copy in which missing servos have their last values and times."""
        gone = frozenset(self.missing)
        columns = (
            tuple([old if i in gone else new for i, (old, new) in enumerate(both)])
            for both in (zip(*pair, strict=True) for pair in zip(last[:9], self[:9], strict=True))
        )
        return Feedback._make((*columns, self.rearmed, self.missing))


class BusHealth(NamedTuple):
    """Counts since the bus was opened: bytes sent and received, and errors by kind."""

    tx_bytes: int
    rx_bytes: int
    errors: Mapping[str, int]


class ServoConfig(NamedTuple):
    """Configuration of one servo on a bus.

    model: name as in the control table, e.g. "xl330-m077"
    min_steps, max_steps: limits; no goal outside is ever sent
    max_speed_steps_s: top speed, written to the servo's own profile
    name: its joint, e.g. "neck_yaw", for messages; "" for none
    gains: the servo's P, I and D of position (Dynamixel: registers 84, 82, 80; STS: 21, 23, 22);
        None leaves them unchanged
    strength: largest share of full drive (Dynamixel: PWM Limit (36); STS: Torque Limit (48)); None
        leaves it unchanged
    max_accel_steps_s2: acceleration written to the servo's own profile, for kinds that have one in
        addition to planned goals (Maestro); None: unlimited
    rest_steps: assumed position of a servo without feedback when its pulses begin: its position
        before torque was switched off; None if it is not needed
    entry_speed_steps_s: speed at which it moves into its limits from outside; None: 30 deg/s at its
        own shaft
    far_steps: distance outside its limits beyond which it gets no torque again after a restart
    """

    id: int
    model: str
    min_steps: int
    max_steps: int
    max_speed_steps_s: float
    name: str = ""
    gains: tuple[int, int, int] | None = None
    strength: float | None = None
    max_accel_steps_s2: float | None = None
    rest_steps: int | None = None
    entry_speed_steps_s: float | None = None
    far_steps: float = inf

    def label(self, noun: str = "servo") -> str:
        """Return its label for messages: its joint and id, or its id alone."""
        return f"{self.name} ({noun} {self.id})" if self.name else f"{noun} {self.id}"


class ServoBus(Protocol):
    """A chain of servos; all sequences are in the order of its setups."""

    def open(self) -> None:
        """Open the port, and find, check and prepare every servo; torque stays off.

        Raises:
            PortError: the port cannot be opened.
            ServoMissing: servos are absent or of another model.
        """

    def read(self, now_s: float) -> Feedback:
        """Read all servos in one exchange.

        While the port is lost, all servos are missing and the port is tried again at intervals.
        After it reconnects, the servos hold their positions and are marked ``rearmed``.

        Raises:
            BusLost: no servo has answered for longer than ``give_up_s``.
        """

    def enable_torque(self) -> tuple[int, ...]:
        """Set every goal to the present position (clipped to its limits), then switch torque on.

        Returns:
            The goals that are now active, in steps.
        """

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo in one packet; goals are clipped to the limits."""

    def faults(self) -> tuple[str, ...]:
        """Return the latched servo faults, one line each, e.g. "servo 7: overload"."""

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, e.g. "servo 3 restarted: set up again"."""

    def disable_torque(self) -> None:
        """Switch torque off on every servo; never raises for a servo that does not answer."""

    def health(self) -> BusHealth:
        """Return byte and error counts."""

    def close(self) -> None:
        """Close the port."""


class Clothing(NamedTuple):
    """Colours of the clothes below a head, as gazerig.drivers.vision.clothing finds them.

    colours: roots of the shares of 24 bins of colour; the inner product of two is their
        Bhattacharyya coefficient, 1 where they are the same
    share: visible share of the measured area, 0..1
    """

    colours: tuple[float, ...]
    share: float


class FaceSigns(NamedTuple):
    """State of the eyes and mouth of a face, at an adult's size.

    eye_opening: opening of the lids over the usual opening, 0 is shut; None if lids are not visible
    mouth_opening_m: gap between the lips, without a mesh up to a constant part; mouth_sd_m:
        standard deviation of its changes
    """

    eye_opening: float | None
    mouth_opening_m: float
    mouth_sd_m: float = 0.0


class Located(NamedTuple):
    """One detection with its position, in the camera's axes (x right, y down, z forward).

    Perception places it in the world, where the same fields are along the world's axes. All fields
    depend only on the image and the calibration.

    R_face: axes of a face, None for a thing and for a person without a visible face
    confidence: 0..1
    face_length: length of a face, in lengths of the canonical one
    depth_measured: whether the camera measured the distance; otherwise a face's is from its size
        and a thing's is assumed
    across_sd_m, along_sd_m: standard deviations of the position, across and along the view
    v_m_s: velocity over ground, None if only the position is known; across_sd_m_s, along_sd_m_s:
        its standard deviations
    size_depth: for a face, ratio of its distance at an adult's size to the measured distance; None
        if the camera measured none
    detector_id: the detector's own id, None if it has none
    turn_sd_rad: for a face, standard deviation of its orientation
    gaze: for a face, unit vector along which the eyes look, None if unknown
    fastest_m, fastest_m_s: for a moving thing, position and velocity of its fastest part, None if
        unknown
    signs: for a face, state of eyes and mouth, None if they are not found
    upper_m: for an upright moving thing, position of its upper end, at a person's head
    compact: for a moving thing, whether its patch is solid and about as wide as high, as a fist's
        or a hand's is and an arm's is not
    thickness_m: for a moving thing, diameter of the largest disc within its patch, at its distance;
        from_side: it extends beyond the left or right edge of the image
    clothing: for a person, colours of the clothes, None if they are not visible
    flat: for a face, whether the measured depth on both sides and above it is that of the face, as
        for a picture or a screen
    """

    kind: str
    p_m: tuple[float, float, float]
    R_face: tuple[_Row, _Row, _Row] | None
    radius_m: float
    spin_rad_s: float = 0.0
    confidence: float = 1.0
    face_length: float = 1.0
    depth_measured: bool = False
    across_sd_m: float = 0.002
    along_sd_m: float = 0.08
    v_m_s: tuple[float, float, float] | None = None
    across_sd_m_s: float = 0.1
    along_sd_m_s: float = 0.5
    size_depth: float | None = None
    detector_id: int | None = None
    turn_sd_rad: float = 0.0
    gaze: tuple[float, float, float] | None = None
    fastest_m: tuple[float, float, float] | None = None
    fastest_m_s: tuple[float, float, float] | None = None
    signs: FaceSigns | None = None
    compact: bool = False
    thickness_m: float = 0.0
    from_side: bool = False
    upper_m: tuple[float, float, float] | None = None
    clothing: Clothing | None = None
    flat: bool = False


class LocatedFrame(NamedTuple):
    """Contents of one image, located in the camera's axes by one calibration.

    intrinsics: the calibration; things: moving things with a position
    faces: visible faces, then heads of people without a visible face, which have no
        ``R_face``
    palms: palms of the nearest person, None in a frame that was not searched for them
    """

    intrinsics: Intrinsics
    faces: tuple[Located, ...]
    things: tuple[Located, ...]
    palms: tuple[Located, ...] | None = None


class FaceMesh(NamedTuple):
    """A dense mesh of a face in an image.

    points: (468, 3) points of MediaPipe's face mesh: x and y in pixels, and z in the same scale,
        smaller towards the camera
    irises_px: (2, 5, 2) the person's right and left iris: centre, then four points on the edge;
        None if the eyes are too small
    lids_px: (2, 16, 2) contours of the same eyes: nine points along the lower lid, from corner to
        corner, and seven along the upper one; None with irises_px
    certainty: confidence that this is a face, 0..1
    """

    points: NDArray[np.float32]
    irises_px: NDArray[np.float32] | None
    lids_px: NDArray[np.float32] | None
    certainty: float


@dataclass(frozen=True, slots=True)
class DetectedFace:
    """A face in an image.

    box_px: x, y, width, height
    landmarks_px: (5, 2): right eye, left eye, nose tip, right and left mouth corner; left and right
        are the person's (the right eye is left in the image)
    confidence: 0..1
    gaze_camera: unit vector along which the eyes look, in the camera frame (x right, y down, z
        forward); None if the detector does not find it
    mesh: its dense mesh, None if none was computed
    clothing: colours of the clothes below it, None if they were not analysed or are not visible
    signs: state of eyes and mouth from a detector without a mesh, None if it finds none
    """

    box_px: tuple[float, float, float, float]
    landmarks_px: Pixels
    confidence: float
    gaze_camera: tuple[float, float, float] | None = None
    mesh: FaceMesh | None = None
    clothing: Clothing | None = None
    signs: FaceSigns | None = None


@dataclass(frozen=True, slots=True)
class DetectedPerson:
    """A person in an image, whose face need not be visible.

    box_px: x, y, width, height of the body from the top of the head to the hips, which may be
        below the image
    head_px: middle of the head
    trunk_px: distance from the hips to the top of the head
    confidence: 0..1
    clothing: colours of the clothes, as for a face
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
    """A moving thing, with its position in the camera frame (x right, y down, z forward).

    id: identity given by the detector, stable from image to image
    kind: "hand", "thing", ...
    spin_rad_s: rotation about the line of view, clockwise in the image above 0
    loom_1_s: growth of its image in parts of its size; above 0 it comes nearer

    The following fields keep their defaults if the detector does not measure them:

    v_camera_m_s: velocity over ground (the camera's own motion is removed), along the camera's axes
        at the capture; None if only positions are known
    depth_known: whether the distance was measured; otherwise it is assumed and depth_sd_m is large
    depth_sd_m, spin_sd_rad_s, loom_sd_1_s: standard deviations
    box_px: x, y, width, height; centre_px: a point on it; area_px: image area that it covers;
        flow_px_s: its mean motion, without the camera's own
    fastest_m, fastest_m_s: position and velocity of its fastest quarter, as ``p_camera_m`` and
        ``v_camera_m_s``: of an arm, the hand
    thickness_m: diameter of the largest disc within it, at the distance of ``p_camera_m``: of an
        arm, about the width of its hand; from_side: it extends beyond the left or right edge
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


SCENES_OF_A_PROCESS: Final = 1_000_000
"""Scene numbers reserved for each process of a camera; the next process starts above them."""


@dataclass(frozen=True, slots=True)
class Detections:
    """Detections in one image.

    captured_s: host time of the exposure; number: counts images from 1
    image: the BGR image itself, if any (never written to after this)
    depth_m: distances from the position of the image's camera, if it measures them: (height_px,
        width_px), NaN where unknown
    lens: the lens if the camera reports it
    located: faces and things in the camera's axes; None: the consumer computes them
    scene: number of the scene shown; it changes at a cut
    people: people with and without a visible face; only some frames are searched for them, each
        only in part
    palms: palms of the nearest person, None in a frame that was not searched
    conditions: conditions that impair the picture, each with its remedy
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
    scene: int = 0
    people: tuple[DetectedPerson, ...] = ()
    palms: tuple[DetectedPalm, ...] | None = None
    conditions: tuple[str, ...] = ()

    def locate_in_camera(
        self, locate: "Callable[[Detections], LocatedFrame] | None"
    ) -> "Detections":
        """Return a copy with its contents located in the camera's axes; unchanged for None."""
        return self if locate is None else replace(self, located=locate(self))


class Camera(Protocol):
    """A source of detections. Only the newest is stored: nothing queues, nothing blocks."""

    def open(self) -> None:
        """Start the source.

        Raises:
            CameraError: it cannot be opened; the message names the device and the remedy.
        """

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections available at ``now_s``, or None before the first.

        Raises:
            CameraError: the source has failed permanently.
        """

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, e.g. "camera lost: trying it again"."""

    def close(self) -> None:
        """Stop and free the source; safe to call twice."""


class FaceDetector(Protocol):
    """A detector of faces in one image; pure except for the network's own memory."""

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
