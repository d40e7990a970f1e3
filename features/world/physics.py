"""Simulation of the world: MuJoCo in steps of a millisecond, moved by the servos of its rig."""

from collections.abc import Callable
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from gazerig.errors import Error
from gazerig.features.world.figure_model import PeoplePlacer
from gazerig.features.world.ideal_bus import IdealShaft
from gazerig.features.world.joint_play import JointPlay
from gazerig.features.world.model import PREFIX, WorldModel
from gazerig.features.world.rig_in_world import ServoInWorld
from gazerig.features.world.shaft import ShaftAxis, WorldHobbyServo, WorldShaft
from gazerig.features.world.state_file import WorldState
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.devices import Emulated, ShaftMakers, build
from gazerig.sim_mock.hobby_servo import HobbyServo, HobbySpec
from gazerig.sim_mock.smart_servo.physics import MS_S, Motor, Physics
from gazerig.sim_mock.smart_servo.shaft import Shaft, create_shaft, whole_ms

DEVICE_MS = 5
"""Period of the update of all devices, so that no watchdog trips late; their servos check heat and
load every 20 ms."""

LONGEST_GAP_MS = 10_000
"""Only the last part of a longer pause between queries of the time is simulated."""


PEOPLE_MS = 4
"""Period of the update of the people's poses."""


_UNSTABLE = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)
"""MuJoCo's warnings of diverged numbers; MuJoCo then resets, which must not reach any servo."""


class WorldUnstable(Error):
    """Divergence of the numbers of a world; its joint angles are no longer valid."""


class _Push(NamedTuple):
    """Force on a body in the world's axes, until a time."""

    body: int
    force_n: NDArray[np.float64]
    until_ms: int


class World:
    """A world that is simulated up to a time on demand.

    The devices built in it share its time: when a device queries its clock, the world and all other
    devices are simulated up to that time first.
    """

    def __init__(self, model: WorldModel, clock_s: Callable[[], float]) -> None:
        self.model = model
        self._mj = model.mj
        self._data: Any = mujoco.MjData(model.mj)
        # Views of its arrays: each access to MuJoCo's structures costs a call.
        self._ctrl, self._qpos, self._qvel = self._data.ctrl, self._data.qpos, self._data.qvel
        self._gain, self._range = model.mj.actuator_biasprm[:, 2], model.mj.actuator_forcerange
        self._warned = self._data.warning.number
        # By default MuJoCo writes its warnings to a file in the user's folder.
        mujoco.set_mju_user_warning(lambda text: None)
        self._clock_s = clock_s
        self._ms = whole_ms(clock_s())
        self._begun_ms = self._ms
        self._busy = False
        self._devices: list[Device] = []
        self._shafts: list[WorldShaft | IdealShaft] = []
        self._lead_rad = np.zeros(model.mj.nq)
        self._play: JointPlay | None = None
        self._actuators = np.zeros(0, np.intp)
        self._pushes: list[_Push] = []
        self._people = PeoplePlacer(model.mj, model.figures)
        self._people.place(self._data, 0.0)
        for name, angle in model.rig.rig.start_rad.items():
            self._data.qpos[model.rig.qpos[name]] = angle
        mujoco.mj_forward(self._mj, self._data)

    # --- devices

    def device(self, line: Emulated, bus: str = "", seed: int = 0) -> Device:
        """Build the servos of one bus, moved by this world.

        Raises:
            ValueError: the device is impossible.
        """
        own = {one.id: one for one in self.model.rig.rig.servos if one.bus == bus}

        def axis(servo_id: int) -> ShaftAxis | None:
            servo = own.get(servo_id)
            return None if servo is None else self._axis(servo)

        def shaft(servo_id: int, model: Motor, physics: Physics, position_steps: float) -> Shaft:
            at = axis(servo_id)
            if at is None:
                return create_shaft(servo_id, model, physics, position_steps)
            made = WorldShaft(model, physics, at)
            self._shafts.append(made)
            return made

        def hobby(spec: HobbySpec) -> HobbyServo:
            at = axis(spec.channel)
            if at is None:
                return HobbyServo(spec)
            made = WorldHobbyServo(spec, at, own[spec.channel].steps_per_turn)
            self._shafts.append(made.shaft)
            return made

        self._busy = True  # no time passes while only some of its shafts are part of the world
        try:
            device = build(line, self.now_s, seed, ShaftMakers(shaft, hobby))
        finally:
            self._busy = False
        self._join()
        self._devices.append(device)
        return device

    def ideal_shafts(self) -> tuple[IdealShaft, ...]:
        """Return shafts without servos, in the order of the rig's servos."""
        servos = self.model.rig.rig.servos
        shafts = tuple(IdealShaft(self._axis(one), one.steps_per_turn) for one in servos)
        self._shafts += shafts
        self._join()
        return shafts

    def _axis(self, servo: ServoInWorld) -> ShaftAxis:
        return ShaftAxis(self._mj, self._data, self._lead_rad, self.model.rig, servo)

    def _join(self) -> None:
        """Move all shafts from now on."""
        play_rad: dict[int, float] = {}
        for one in self._shafts:
            play_rad |= one.axis.play_rad
        if play_rad:
            self._play = JointPlay(self._mj, self._data, self._lead_rad, play_rad)
        self._actuators = np.array([one.axis.actuator for one in self._shafts], dtype=np.intp)
        # Let MuJoCo update the constants that depend on inertias: shafts now have rotors.
        kept = np.array(self._data.qpos), np.array(self._data.qvel)
        mujoco.mj_setConst(self._mj, self._data)
        self._data.qpos[:], self._data.qvel[:] = kept
        mujoco.mj_forward(self._mj, self._data)

    # --- time

    def now_s(self) -> float:
        """Return the time up to which the world has been simulated."""
        if self._busy:  # a device queries the time while the world simulates it
            return self._ms / 1000.0
        now_s = self._clock_s()
        self.advance(whole_ms(now_s))
        return now_s

    def advance(self, until_ms: int) -> None:
        """Simulate the world and its devices up to a time, in steps of a millisecond.

        Raises:
            WorldUnstable: the numbers have diverged.
        """
        if self._busy or until_ms <= self._ms:
            return
        self._busy = True
        try:
            self._ms = max(self._ms, until_ms - LONGEST_GAP_MS)
            while self._ms < until_ms:
                self._step()
        finally:
            self._busy = False

    def _step(self) -> None:
        """Simulate a millisecond."""
        data, shafts = self._data, self._shafts
        if shafts:
            efforts = np.array([one.command() for one in shafts])
            self._ctrl[self._actuators] = efforts[:, 0]
            self._gain[self._actuators] = efforts[:, 1]
            self._range[self._actuators] = efforts[:, 2:]
        if self._pushes:
            # The forces of this millisecond; expired ones are removed.
            wrenches = data.xfrc_applied
            for push in self._pushes:
                wrenches[push.body] = 0.0
            self._pushes = [push for push in self._pushes if self._ms < push.until_ms]
            for push in self._pushes:
                lever = data.xpos[push.body] - data.xipos[push.body]
                wrenches[push.body, :3] += push.force_n
                wrenches[push.body, 3:] += np.cross(lever, push.force_n)
        if self._ms % PEOPLE_MS == 0:
            self._people.place(data, self._script_s())
        play = self._play
        if play is not None:
            play.begin()
        mujoco.mj_step(self._mj, data)
        self._ms += 1
        qvel = self._qvel.tolist()
        if play is None:
            qpos = self._qpos.tolist()
        else:
            play.hold()
            qpos = (self._qpos + self._lead_rad).tolist()
        for one in shafts:
            axis = one.axis
            slope = axis.slope
            if slope is not None:
                one.sense(axis.zero + slope * qpos[axis.qpos], slope * qvel[axis.dof] * MS_S)
            else:
                x, speed = axis.motion(qpos, qvel)
                one.sense(x, speed * MS_S)
        if self._ms % DEVICE_MS == 0:
            if self._warned[_UNSTABLE].any():
                raise WorldUnstable(
                    f"the world became unstable {self._data.time:.3f} s after its beginning: a body "
                    "of it is too light or too stiff for steps of 1 ms"
                )
            for device in self._devices:
                device.positions_steps()

    # --- people

    def _script_s(self) -> float:
        return max(0, self._ms - self._begun_ms) / 1000.0

    def begin(self, at_ms: int) -> None:
        """Start the script of the people at a time; until then they keep their first pose."""
        self._begun_ms = at_ms

    # --- from outside

    def push(self, body: str, force_n: tuple[float, float, float], for_s: float) -> None:
        """Push a body of the rig for a time, at its own origin.

        Args:
            body: its name in the rig, such as "head".
            force_n: force in the world's axes.
            for_s: duration.

        Raises:
            ValueError: the body does not exist.
        """
        names = [self._mj.body(i).name for i in range(self._mj.nbody)]
        own = {name[len(PREFIX) :]: i for i, name in enumerate(names) if name.startswith(PREFIX)}
        if body not in own:
            raise ValueError(f"no body {body!r}: there is {', '.join(own)}")
        self._pushes.append(_Push(own[body], np.array(force_n), self._ms + round(for_s * 1000.0)))

    def state(self) -> WorldState:
        """Return the current state."""
        return WorldState(self._ms / 1e3, self._script_s(), np.array(self._data.qpos))

    def joints_rad(self) -> dict[str, float]:
        """Return the current true joint angles of the rig."""
        return {n: float(self._data.qpos[at]) for n, at in self.model.rig.qpos.items()}
