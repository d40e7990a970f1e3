"""Couplings in a rig's file, and the configuration of their servos for the whole range."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import ceil, degrees, floor, radians
from typing import Annotated, Literal, NamedTuple

from gazerig.drivers.bus.goal_limits import ENTRY_DEG_S, FAR_DEG
from gazerig.drivers.types import ServoConfig
from gazerig.gaze.types import Vec3
from gazerig.params import Bounds, Unit
from gazerig.robot.model.coupling import (
    Coupling,
    Differential,
    MeasuredGrid,
    Pair,
    PushRods,
    Unreachable,
)
from gazerig.robot.model.joint import JointParams

CouplingKind = Literal["differential", "parallel", "measured"]
_GRID = 12
"""Cells per side of the joints' range in the search for the servos' extremes."""


@dataclass(frozen=True)
class CouplingParams:
    """Two servos that move two joints together."""

    # fmt: off
    kind: Annotated[CouplingKind, "differential: bevel gears; parallel: two push rods; measured: a table of positions"]
    first: Annotated[str, "joint that both servos turn in the same direction, such as neck_pitch; its entry in joints is servo a, "
                          "in a parallel neck the left one"]
    second: Annotated[str, "joint that they turn in opposite directions, such as neck_roll; its entry is servo b"]
    first_ratio: Annotated[float, Bounds(0.05, 50), "differential: turns of the servos for one turn of the first joint"] = 1.0
    second_ratio: Annotated[float, Bounds(0.05, 50), "differential: turns of the servos for one turn of the second joint"] = 1.0
    anchor_mm: Annotated[tuple[float, float, float] | None, Bounds(-500, 500),
        "parallel: anchor of the left rod on the head, ahead, left and above of the pitch axis with the head level"] = None
    servo_mm: Annotated[tuple[float, float, float] | None, Bounds(-500, 500),
        "parallel: axis of the left servo's horn; the right side is its mirror image"] = None
    horn_mm: Annotated[float | None, Bounds(-500, 500), "parallel: length of the horns, negative where they point back; "
        "a horn is level at the servo's 0 deg"] = None
    rod_mm: Annotated[float | None, Bounds(1, 1000), "parallel: length of the rods between their joints"] = None
    points: Annotated[tuple[tuple[float, float, float, float], ...], Bounds(-360, 360), Unit("deg"),
        "measured: [first joint, second joint, servo a, servo b] at every point of a grid of joint angles"] = ()
    # fmt: on

    def __post_init__(self) -> None:
        """Check that all dimensions of its kind are given.

        Raises:
            ValueError: Dimensions are missing or wrong; the message names them.
        """
        if self.first == self.second:
            raise ValueError(f"first and second are both {self.first}; give two different joints")
        needed = ("anchor_mm", "servo_mm", "horn_mm", "rod_mm")
        missing = [key for key in needed if getattr(self, key) is None]
        if self.kind == "parallel" and (missing or self.horn_mm == 0.0):
            raise ValueError(f"a parallel coupling needs {', '.join(missing or ['a horn_mm'])}")
        self.make_coupling()

    def make_coupling(self) -> Coupling:
        """Build the coupling.

        Raises:
            ValueError: The coupling is impossible; the message gives the reason.
        """
        if self.kind == "differential":
            return Differential(self.first_ratio, self.second_ratio)
        if self.kind == "measured":
            return MeasuredGrid(
                [
                    (radians(first), radians(second), radians(a), radians(b))
                    for first, second, a, b in self.points
                ]
            )
        assert self.anchor_mm is not None and self.servo_mm is not None
        assert self.horn_mm is not None and self.rod_mm is not None
        try:
            return PushRods(
                _metres(self.anchor_mm),
                _metres(self.servo_mm),
                self.horn_mm / 1e3,
                self.rod_mm / 1e3,
            )
        except Unreachable as error:
            raise ValueError(f"with the head level {error}") from None


class CoupledPair(NamedTuple):
    """A coupling with the names of its two joints."""

    first: str
    second: str
    coupling: Coupling


def coupled_pairs(couplings: Mapping[str, CouplingParams]) -> tuple[CoupledPair, ...]:
    """Return the coupled pairs of a rig."""
    return tuple(
        CoupledPair(one.first, one.second, one.make_coupling()) for one in couplings.values()
    )


def joint_partners(pairs: Iterable[CoupledPair]) -> dict[str, str]:
    """Return the partner of each coupled joint."""
    return {a: b for first, second, _ in pairs for a, b in ((first, second), (second, first))}


def unreachable_text(pair: CoupledPair, joints: Mapping[str, JointParams]) -> str | None:
    """Return a text about joint angles that the servos cannot reach, None if they reach all.

    Args:
        pair: The coupled pair.
        joints: Joints of the rig, with known servo models.
    """
    for at in _joint_grid(pair, joints):
        where = f"{pair.first} {degrees(at[0]):g}, {pair.second} {degrees(at[1]):g} deg"
        if isinstance(pair.coupling, MeasuredGrid) and not pair.coupling.contains(at):
            return f"cannot reach {where}: its points do not extend that far"
        try:
            servos = pair.coupling.servo_rad(at)
        except Unreachable as error:
            return f"cannot reach {where}: {error}"
        for name, angle in zip((pair.first, pair.second), servos, strict=True):
            facts, steps = joints[name].model_facts, joints[name].steps(angle)
            if not facts.lowest <= steps <= facts.highest:
                low, high, at_ = (
                    value / facts.unit_steps for value in (facts.lowest, facts.highest, steps)
                )
                return (
                    f"cannot reach {where}: the servo of {name} would be at {at_:.0f} "
                    f"{facts.unit}, outside its {low:.0f}..{high:.0f}"
                )
    return None


def pair_setups(
    pair: CoupledPair,
    joints: Mapping[str, JointParams],
    park_rad: Mapping[str, float],
    gentle_deg_s: float = ENTRY_DEG_S,
) -> dict[str, ServoConfig]:
    """Return the configuration of both servos for the whole range of both joints.

    Args:
        pair: The coupled pair.
        joints: Joints of the rig.
        park_rad: Parking pose by joint, default 0.
        gentle_deg_s: Highest speed at which servos outside their ranges move inside.
    """
    names = pair.first, pair.second
    grid = tuple(_joint_grid(pair, joints))
    servos = [pair.coupling.servo_rad(at) for at in grid]
    rates = [pair.coupling.rates(at) for at in grid]
    rest = pair.coupling.servo_rad((park_rad.get(names[0], 0.0), park_rad.get(names[1], 0.0)))
    speeds = [radians(joints[name].max_speed_deg_s) for name in names]
    accels = [radians(joints[name].max_accel_deg_s2) for name in names]
    found = {}
    for k, name in enumerate(names):
        joint, linkage = joints[name], joints[name].make_linkage()
        slopes = [rate[k] for rate in rates]
        fastest = max(_combined_limit(slope, speeds) for slope in slopes)
        quickest = max(_combined_limit(slope, accels) for slope in slopes)
        steps = [linkage.steps(angles[k]) for angles in servos]
        steepest = max(abs(slope) for pair_slopes in slopes for slope in pair_slopes)
        gentle = radians(min(ENTRY_DEG_S, gentle_deg_s)) * steepest
        config = joint.setup(name, park_rad.get(name, 0.0), gentle_deg_s)
        found[name] = config._replace(
            min_steps=ceil(min(steps) - 1e-6),
            max_steps=floor(max(steps) + 1e-6),
            max_speed_steps_s=fastest * linkage.steepest,
            max_accel_steps_s2=quickest * linkage.steepest,
            rest_steps=None if config.rest_steps is None else round(linkage.steps(rest[k])),
            entry_speed_steps_s=gentle * linkage.steepest,
            far_steps=radians(FAR_DEG) * steepest * linkage.steepest,
        )
    return found


def _joint_grid(pair: CoupledPair, joints: Mapping[str, JointParams]) -> Iterator[Pair]:
    """Return a grid of joint angles over the whole range, its corners first."""
    one, other = joints[pair.first].limit(), joints[pair.second].limit()
    ends = [(one.low_rad, one.high_rad), (other.low_rad, other.high_rad)]
    yield from ((first, second) for first in ends[0] for second in ends[1])
    first_axis, second_axis = (
        [low + (high - low) * k / _GRID for k in range(_GRID)] + [high] for low, high in ends
    )
    yield from ((first, second) for first in first_axis for second in second_axis)


def _combined_limit(slope: Pair, most: list[float]) -> float:
    return abs(slope[0]) * most[0] + abs(slope[1]) * most[1]


def _metres(point: Vec3) -> Vec3:
    return point[0] / 1e3, point[1] / 1e3, point[2] / 1e3
