"""Mutants of animation files, tracks and limp joints: a wrong line, and who notices."""

from mutants.mutants import Mutant

FILES = ("animation_files",)
ANIMATION = (
    Mutant("features/animation/gltf_reader.py", "w0, v0 = rest[0], -rest[1:]", "w0, v0 = rest[0], rest[1:]",
           "angles are relative to the mirrored rest pose", FILES),
    Mutant("features/animation/gltf_reader.py", "np.unwrap(2.0 * np.arctan2(along, w))", "2.0 * np.arctan2(along, w)",
           "a joint that passes half a turn jumps by a whole one", FILES),
    Mutant("features/animation/gltf_reader.py", "+ span * (s**3 - 2.0 * s**2 + s) * keys[i, 2]\n", "",
           "splines ignore their first tangents", FILES),
    Mutant("features/animation/animation.py", "leave_s = np.maximum(times_s[1:] - np.maximum(needed, SAMPLE_S), times_s[:-1])",
           "leave_s = times_s[1:] - SAMPLE_S", "a step is faster than the joint", FILES),
    Mutant("features/animation/glb.py", "if length > len(data):", "if False:", "a truncated file is read", FILES),
    Mutant("features/animation/bottango.py", "_WEIGHTS @ (y0, y0 + y1, y3 + y2, y3)", "_WEIGHTS @ (y0, y1, y2, y3)",
           "handles are absolute", FILES),
    Mutant("robot/model/track_fit.py", "np.maximum.reduceat(peak[: rows[-1] + 1, j], starts)", "peak[rows, j]",
           "keys of other channels hide the speed of a joint", FILES),
    Mutant("robot/app/track_file.py", "rests = [(-GRID_S, found[0][1]), found[0]] if begins_s else []", "rests = [found[0]] if begins_s else []",
           "the first pose is passed at speed", FILES),
    Mutant("features/bringup/hand_recording.py", "        if not rows or row[0] > rows[-1][0]:\n            rows.append(row)\n",
           "        rows.append(row)\n", "a lost head's last angle is recorded twice", ("live_recording",)),
    Mutant("robot/control/joint_latency.py", "np.where(valid, read_s, times_s[0])", "np.where(valid, times_s[used, None], times_s[0])",
           "the time of the reading is no part of the latency", ("joint_latency",)),
    Mutant("gaze/track/track_motion.py", "curve.state_at(max(0.0, t_s - delay_s))", "curve.state_at(max(0.0, t_s))",
           "joints of faster buses are too early", ("joint_latency",)),
    Mutant("drivers/servo_bus/transient_faults.py", "            return self.limp\n", "            return frozenset()\n",
           "a limp servo gets goals, with which some firmware switches torque on", ("limp_joints",)),
    Mutant("robot/safety/guard.py", "if i in self.limp and not fault", "if False and not fault",
           "a limp joint counts as faulty and starts slowly", ("limp_joints",)),
    Mutant("robot/control/limp_joints.py", "if held or not abs(", "if not abs(", "a joint that a client holds goes limp", ("limp_joints",)),
    Mutant("robot/control/loop.py", "        self.body.wake()\n", "", "a limp joint does not park", ("limp_joints",)),
    Mutant("robot/control/track_choices.py", "        limits = self._remaining(limits, beside)\n", "",
           "the sum of two tracks turns an eye too fast", ("track_player",)),
)  # fmt: skip
