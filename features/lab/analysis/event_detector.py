"""Saccades and fixations, detected tick by tick as by an eye tracker.

All values are measured at the servos: the mean of both lines of sight in space. Without feedback
they are estimated from the goals. The commanded saccade is stored with the measured one, so that
both can be compared.

The speed is that of Engbert & Kliegl 2003, a central difference over five samples. It is relative
to the slow motion of the last 50 ms, so that pursuit of a walking person is not a saccade. 30 deg/s
above that is the usual threshold of velocity-based detection (I-VT).
"""

from collections import Counter, deque
from math import degrees, exp, inf, sqrt
from typing import NamedTuple

from gazerig.gaze.angles import add, angle_between, cross, dot, norm, scale, sub, unit
from gazerig.gaze.types import PARTS, Vec3
from gazerig.robot.control.tick import Tick, cyclopean_direction
from gazerig.robot.model.types import GAZE_JOINTS

THRESHOLD_DEG_S = 30.0
"""Relative speed at which a saccade begins; one servo step of both eyes per tick is half of it."""

LEAST_DEG = 0.5
"""Smaller saccades cannot be distinguished from encoder steps."""

_FOOT_SHARE, _FOOT_DEG_S = 0.1, 10.0
"""A saccade lasts while its speed is above this fraction of its peak, and above this speed."""

_TOP_SHARE = 0.9
"""The time of the peak is the middle of the interval above this fraction: capped peaks are flat."""

_SWING_SHARE, _AGAIN_SHARE = 0.35, 0.5
"""A minimum below the first fraction of the peak is the landing, even while a servo swings back
(the glissade of Nystroem & Holmqvist 2010). Later motion above the second fraction is a new
saccade."""

_LANDING_S = 0.15

_SLOW_S = 0.05
_FARTHEST_S = 0.022
"""Samples farther apart in time do not give the speed of a saccade."""

_NEAREST_S = 0.0035
"""Samples at shorter intervals are skipped: their differences are only encoder steps."""

_GAP_S = 0.06
_LONGEST_S = 0.4
_KEPT = 160


class CommandedSaccade(NamedTuple):
    """Saccade commanded by the models."""

    onset_s: float
    duration_s: float
    amplitude_deg: float
    peak_deg_s: float


class SaccadeEvent(NamedTuple):
    """One saccade of the gaze in space.

    peak_share: time of the peak speed as a fraction of the duration; .5 is symmetric
    commanded: the commanded saccade, None if the eyes jumped without a command
    """

    onset_s: float
    duration_s: float
    amplitude_deg: float
    peak_deg_s: float
    peak_share: float
    commanded: CommandedSaccade | None = None

    @property
    def end_s(self) -> float:
        """Return the time of the landing."""
        return self.onset_s + self.duration_s


class _DirectionSample(NamedTuple):
    t_s: float
    direction: Vec3


class _SpeedSample(NamedTuple):
    """One sample with its speed.

    velocity_1_s: smoothed velocity of the unit vector; relative_deg_s: speed relative to the slow
    motion; sharp_deg_s: speed over three samples only, for the peak
    """

    t_s: float
    direction: Vec3
    velocity_1_s: Vec3
    relative_deg_s: float
    unsmoothed_deg_s: float


class SaccadeFinder:
    """Finds saccades in a sequence of gaze directions; each is returned when it has ended."""

    def __init__(self) -> None:
        self.is_in_flight = False
        self.clear()

    def clear(self) -> None:
        """Forget the trace: there was a gap."""
        self._samples: deque[_DirectionSample] = deque(maxlen=5)
        self._speeds: deque[_SpeedSample] = deque(maxlen=_KEPT)
        self._slow: Vec3 = (0.0, 0.0, 0.0)
        self._peak_deg_s = 0.0
        self._before_deg_s = 0.0
        self._began_s = 0.0
        self._barrier_s = -inf
        self._settles_s: float | None = None
        self.is_in_flight = False

    def update(self, t_s: float, direction: Vec3) -> SaccadeEvent | None:
        """Add a unit direction in the world; return the saccade that has just ended, if any."""
        samples = self._samples
        if samples:
            since_s = t_s - samples[-1].t_s
            if since_s > _GAP_S or since_s < 0.0:
                self.clear()
                samples = self._samples
            elif since_s < _NEAREST_S:
                return None
        samples.append(_DirectionSample(t_s, direction))
        if len(samples) < 5:
            return None
        speed = self._speed()
        self._speeds.append(speed)
        return self._advance_state(speed)

    def _speed(self) -> _SpeedSample:
        """Return the speed at the middle sample, and learn the slow motion from it."""
        a, b, c, d, e = self._samples
        (bx, by, bz), (dx, dy, dz) = b.direction, d.direction
        sharp_s = d.t_s - b.t_s
        x, y, z = (dx - bx), (dy - by), (dz - bz)
        sharp = sqrt(x * x + y * y + z * z) / sharp_s
        over_s = sharp_s
        if e.t_s - a.t_s < 2.0 * _FARTHEST_S:
            (ax, ay, az), (ex, ey, ez) = a.direction, e.direction
            x, y, z = x + ex - ax, y + ey - ay, z + ez - az
            over_s += e.t_s - a.t_s
        vx, vy, vz = x / over_s, y / over_s, z / over_s
        sx, sy, sz = self._slow
        rx, ry, rz = vx - sx, vy - sy, vz - sz
        relative = degrees(sqrt(rx * rx + ry * ry + rz * rz))
        if not self.is_in_flight and relative <= THRESHOLD_DEG_S:
            share = 1.0 - exp(-0.5 * sharp_s / _SLOW_S)
            self._slow = (sx + share * rx, sy + share * ry, sz + share * rz)
        return _SpeedSample(c.t_s, c.direction, (vx, vy, vz), relative, degrees(sharp))

    def _advance_state(self, speed: _SpeedSample) -> SaccadeEvent | None:
        """Follow the three states: at rest, in flight, and settling after a landing."""
        now, before = speed.relative_deg_s, self._before_deg_s
        self._before_deg_s = now
        if self._settles_s is not None:
            long = speed.t_s - self._settles_s > _LANDING_S
            if now < THRESHOLD_DEG_S or long:
                self._settles_s, self.is_in_flight = None, False
                if long:
                    self._end_as_slow_motion(speed)
                return None
            if now <= _AGAIN_SHARE * self._peak_deg_s:
                return None
            self._settles_s = None
        elif self.is_in_flight:
            return self._await_landing(speed, before)
        if now > THRESHOLD_DEG_S:
            self.is_in_flight = True
            self._peak_deg_s, self._began_s = now, speed.t_s
        return None

    def _await_landing(self, speed: _SpeedSample, before_deg_s: float) -> SaccadeEvent | None:
        """Wait for the landing: a low speed, or a minimum before the eye swings back."""
        now = speed.relative_deg_s
        # Relative to the peak so far: a saccade is also slow at its beginning.
        swings = before_deg_s < _SWING_SHARE * self._peak_deg_s and now > before_deg_s
        self._peak_deg_s = max(self._peak_deg_s, now)
        if now < self._onset_speed_deg_s() or swings:
            jump = self._measure_saccade(len(self._speeds) - (1 if swings else 0))
            self._barrier_s = jump.onset_s + jump.duration_s
            self.is_in_flight = now > THRESHOLD_DEG_S
            self._settles_s = speed.t_s if self.is_in_flight else None
            return jump if jump.amplitude_deg >= LEAST_DEG else None
        if speed.t_s - self._began_s > _LONGEST_S:
            self._end_as_slow_motion(speed)
        return None

    def _end_as_slow_motion(self, speed: _SpeedSample) -> None:
        """Treat motion that lasts too long for a saccade as slow motion."""
        self.is_in_flight, self._slow, self._barrier_s = False, speed.velocity_1_s, speed.t_s

    def _onset_speed_deg_s(self) -> float:
        return max(_FOOT_SHARE * self._peak_deg_s, _FOOT_DEG_S)

    def _measure_saccade(self, end: int) -> SaccadeEvent:
        """Measure the saccade that ended at the last of the first ``end`` speeds."""
        foot, speeds = self._onset_speed_deg_s(), self._speeds
        first = end - 1
        while first > 0 and speeds[first - 1].t_s >= self._barrier_s:
            first -= 1
            if speeds[first].relative_deg_s < foot and speeds[first].t_s < self._began_s:
                break
        part = [speeds[i] for i in range(first, end)]
        onset_s, end_s = (
            _crossing_time_s(part[0], part[1], foot),
            _crossing_time_s(part[-1], part[-2], foot),
        )
        inner = part[1:-1] or part
        peak = max(speed.unsmoothed_deg_s for speed in inner)
        top = [speed.t_s for speed in inner if speed.unsmoothed_deg_s >= _TOP_SHARE * peak]
        duration_s = end_s - onset_s
        return SaccadeEvent(
            onset_s,
            duration_s,
            degrees(angle_between(part[0].direction, part[-1].direction)),
            peak,
            (0.5 * (top[0] + top[-1]) - onset_s) / duration_s,
        )


def _crossing_time_s(below: _SpeedSample, above: _SpeedSample, level: float) -> float:
    """Return the time when the speed crossed a level between two samples."""
    span = above.relative_deg_s - below.relative_deg_s
    share = (level - below.relative_deg_s) / span if span > 0.0 else 0.0
    return below.t_s + min(1.0, max(0.0, share)) * (above.t_s - below.t_s)


NEAR_PART_M = 0.03
"""Largest distance at which a line of sight is on a part."""

NEAR_FACE_M = 0.12
"""Largest distance from the face's centre at which a line of sight is on the face."""

_LOOK_EVERY_S = 0.024
"""Interval at which the part is determined during a fixation."""

SHORTEST_S = 0.04
"""Shortest fixation between two saccades."""

_SETTLING_S = 0.02
"""Delay after a saccade before the part is determined."""

_LONGEST_FORESEEN_S = 0.3
_COMMAND_BEFORE_S, _COMMAND_AFTER_S = 0.12, 0.03
_EYE_JOINTS = frozenset(name for name in GAZE_JOINTS if "eye" in name)


class FixationEvent(NamedTuple):
    """Fixation of the gaze between two saccades, on one place or on a moving target.

    part: the face part nearest to the lines of sight, None off the parts
    on_face: whether it was on any face
    target_kind: kind of the current target
    """

    start_s: float
    duration_s: float
    part: str | None
    on_face: bool
    target_kind: str

    @property
    def end_s(self) -> float:
        """Return the start of the next saccade."""
        return self.start_s + self.duration_s


class EventDetector:
    """Finds saccades and fixations in ticks as they arrive; keeps them when they are over."""

    def __init__(self) -> None:
        self.saccades = list[SaccadeEvent]()
        self.fixations = list[FixationEvent]()
        self._finder = SaccadeFinder()
        self._commands: deque[CommandedSaccade] = deque(maxlen=4)
        self._flight: _CommandedFlight | None = None
        self._rest = _OpenFixation(None)

    def update(self, tick: Tick) -> None:
        """Add a tick."""
        if tick.stopped or not _EYE_JOINTS.isdisjoint(tick.joints.missing):
            # The eyes were not measured, or not moved by the models.
            self._finder.clear()
            self._flight = None
            self._rest = _OpenFixation(None)
            return
        self._follow_command(tick)
        direction = cyclopean_direction(tick)
        saccade = self._finder.update(tick.t_s, direction)
        if saccade is not None:
            fixation = self._rest.close(saccade.onset_s)
            if fixation is not None:
                self.fixations.append(fixation)
            command = self._find_command(saccade.onset_s)
            self.saccades.append(saccade._replace(commanded=command))
            self._rest = _OpenFixation(saccade.end_s)
        elif not self._finder.is_in_flight:
            self._rest.update(tick, direction)

    def _follow_command(self, tick: Tick) -> None:
        """Follow the current saccade of the models."""
        flying = tick.gaze.phase == "saccade"
        if not flying and self._flight is None:
            return
        direction = unit(sub(tick.gaze.gaze_point_world_m, tick.pose.p_world_head_m))
        if self._flight is None:
            self._flight = _CommandedFlight(tick.t_s, direction)
            return
        self._flight.update(tick.t_s, direction)
        if not flying:
            self._commands.append(self._flight.command)
            self._flight = None

    def _find_command(self, onset_s: float) -> CommandedSaccade | None:
        """Find the command of a saccade, which is measured later by the lag of the servo."""
        known = list(self._commands)
        if self._flight is not None:
            known.append(self._flight.command)
        for command in reversed(known):
            if -_COMMAND_AFTER_S <= onset_s - command.onset_s <= _COMMAND_BEFORE_S:
                if command in self._commands:
                    # An eye swings back without a command.
                    self._commands.remove(command)
                return command
        return None


class _CommandedFlight:
    """A commanded saccade, followed from its first tick."""

    def __init__(self, t_s: float, direction: Vec3) -> None:
        self._start_s = self._last_s = t_s
        self._start = self._last = direction
        self._peak_rad_s = 0.0

    def update(self, t_s: float, direction: Vec3) -> None:
        """Add the commanded gaze direction at ``t_s``."""
        if t_s > self._last_s:
            speed = angle_between(self._last, direction) / (t_s - self._last_s)
            self._peak_rad_s = max(self._peak_rad_s, speed)
        self._last_s, self._last = t_s, direction

    @property
    def command(self) -> CommandedSaccade:
        """Return the commanded saccade as far as it is known."""
        return CommandedSaccade(
            self._start_s,
            self._last_s - self._start_s,
            degrees(angle_between(self._start, self._last)),
            degrees(self._peak_rad_s),
        )


class _OpenFixation:
    """Time between two saccades, and the fixated target."""

    def __init__(self, start_s: float | None) -> None:
        self._start_s = start_s
        self._next_s = -1.0
        self._parts: Counter[str | None] = Counter()
        self._on_face: Counter[bool] = Counter()
        self._kinds: Counter[str] = Counter()

    def update(self, tick: Tick, direction: Vec3) -> None:
        """Determine at intervals the part under the gaze."""
        t_s = tick.t_s
        if self._start_s is None:
            self._start_s = t_s
        if t_s < self._next_s or t_s < self._start_s + _SETTLING_S:
            return
        self._next_s = t_s + _LOOK_EVERY_S
        part, on_face = part_looked_at(tick, direction)
        self._parts[part] += 1
        self._on_face[on_face] += 1
        self._kinds[tick.target.kind] += 1

    def close(self, end_s: float) -> FixationEvent | None:
        """Return the fixation, None if it was too short."""
        if self._start_s is None or end_s - self._start_s < SHORTEST_S:
            return None
        if not self._parts:
            return FixationEvent(self._start_s, end_s - self._start_s, None, False, "")
        return FixationEvent(
            self._start_s,
            end_s - self._start_s,
            self._parts.most_common(1)[0][0],
            self._on_face.most_common(1)[0][0],
            self._kinds.most_common(1)[0][0],
        )


def part_looked_at(tick: Tick, direction: Vec3) -> tuple[str | None, bool]:
    """Return the face part at the measured gaze, and whether it is on a face.

    direction: unit vector of the gaze in the world
    """
    if tick.percept is None:
        return None, False
    head = tick.pose.p_world_head_m
    since_s = min(max(0.0, tick.t_s - tick.percept.captured_s), _LONGEST_FORESEEN_S)
    for face in tick.percept.faces:
        moved = scale(face.v_world_m_s, since_s)
        if miss_distance_m(direction, sub(add(face.p_world_m, moved), head)) <= NEAR_FACE_M:
            shift_m = sub(moved, head)
            apart = [miss_distance_m(direction, add(p, shift_m)) for p in face.parts_world_m]
            least = min(apart)
            return (PARTS[apart.index(least)] if least <= NEAR_PART_M else None), True
    return None, False


def miss_distance_m(direction: Vec3, rel_m: Vec3) -> float:
    """Return the distance between a line of sight and a place; both are relative to the eye."""
    if dot(direction, rel_m) <= 0.0:
        return norm(rel_m)
    return norm(cross(direction, rel_m))
