"""Tracks from animation programs, and back: import and export.

Interface: the commands ``import`` and ``export-track`` (commands.py). ``animation.read_animation``
reads a file of any kind; one module reads each kind: CSV (table.py), glTF (gltf_reader.py), the
Blender add-on Servo Animation (servo_positions.py) and Bottango (bottango.py). gltf_writer.py adds
a track's motion to the glTF model that ``gazerig describe`` writes.
"""
