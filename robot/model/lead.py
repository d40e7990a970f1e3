"""Who leads the head in place of what attracts it: a point to look at, or joints held by hand.

A lead needs a heartbeat unless it is to stay: without one the gaze leads again. Pure: times
are those of the ticks and heartbeats are commands, so a recorded run lapses as it did.
"""

from math import degrees

from gazerig.gaze.types import Target, Vec3
from gazerig.robot.model.commands import Jog, LookAt, Renew
from gazerig.robot.model.types import JointAngles

HEARTBEAT_S = 1.0
"""A lead that is not to stay lapses when it was not renewed for so long."""


class Lead:
    """The lead in force.

    point: to look at, world frame; None if none was chosen
    pose_rad: joints held by hand, empty while the models move them
    words: who leads and what, "" while no client leads
    """

    def __init__(self) -> None:
        self.point: Vec3 | None = None
        self.pose_rad: JointAngles = ()
        self.words = ""
        self._shifts = 0
        self._jogged: dict[str, float] = {}
        self._who = ""
        self._stay = False
        self._renewed_s = 0.0

    @property
    def active(self) -> bool:
        """True while anybody leads."""
        return bool(self.words)

    def look(self, command: LookAt, t_s: float) -> None:
        """Lead the gaze to a point, or let it be free; joints are no longer held."""
        self.point = command.p_world_m
        self._shifts += 1
        self.pose_rad = ()
        self._jogged.clear()
        self._take(command, t_s)

    def jog(self, command: Jog, names: tuple[str, ...], now_rad: JointAngles, t_s: float) -> None:
        """Hold all joints but those given; without any, return them to the gaze models.

        now_rad: where the joints are held that have not been jogged yet
        """
        if not command.angles_rad:
            self.pose_rad = ()
            self._jogged.clear()
            self._describe()
            return
        if command.who != self._who:
            self.point = None
        angles = dict(zip(names, self.pose_rad or now_rad, strict=True))
        angles.update(command.angles_rad)
        self.pose_rad = tuple(angles[name] for name in names)
        self._jogged.update(command.angles_rad)
        self._take(command, t_s)

    def renew(self, command: Renew, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the client that leads."""
        mine = self.active and command.who == self._who
        if mine:
            self._renewed_s = t_s
        return mine

    def lapsed(self, t_s: float) -> bool:
        """True if the one who leads has been silent for too long."""
        return self.active and not self._stay and t_s - self._renewed_s > HEARTBEAT_S

    def end(self) -> None:
        """End the lead: the gaze models move the head again."""
        if self.point is not None:
            self._shifts += 1
        self.point, self.pose_rad = None, ()
        self._jogged.clear()
        self._describe()

    def target(self, target: Target, t_s: float) -> Target:
        """Return the point that a person chose in the place of what attention did."""
        puppet = self.puppet(t_s)
        if puppet is None:
            return target
        return puppet._replace(shift=target.shift + self._shifts, saliences=target.saliences)

    def puppet(self, t_s: float) -> Target | None:
        """Return the point that a user chose, None if none was chosen."""
        if self.point is None:
            return None
        return Target(
            self.point, (0.0, 0.0, 0.0), t_s, "puppet", -1, 1.0, True, None,
            self._shifts, "somebody chose this point",
        )  # fmt: skip

    def _take(self, command: LookAt | Jog, t_s: float) -> None:
        self._who, self._stay, self._renewed_s = command.who, command.stay, t_s
        self._describe()

    def _describe(self) -> None:
        """Return who leads and what."""
        if self.pose_rad:
            angles = (f"{name} {degrees(angle):.1f}" for name, angle in self._jogged.items())
            what = f"jog {', '.join(angles)}"
        elif self.point is not None:
            what = "look at {:g} {:g} {:g}".format(*(round(x, 2) for x in self.point))
        else:
            self.words = ""
            return
        self.words = f"{self._who or 'somebody'}: {what}"
