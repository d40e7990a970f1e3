"""Mutants of animation files and of tracks recorded live: a wrong line, and who notices."""

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
)  # fmt: skip
