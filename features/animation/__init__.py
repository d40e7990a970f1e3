"""Tracks from animation programs.

Interface: the command ``import`` (commands.py). ``animation.read_animation``
reads a file of any kind; one module reads each kind: CSV (table.py), glTF (gltf_reader.py), the
Blender add-on Servo Animation (servo_positions.py) and Bottango (bottango.py).
"""
