"""World with physics: a room with people, the rig in it, and the images of its camera.

Interface: the surroundings ``world`` (run/surroundings.py), for ``gazerig run --world``. It needs
MuJoCo, the extra ``world``.

In this folder: the script (script.py, its faults and timeline), the people's motion and shape, the
room, the model for MuJoCo and its physics, the renderer, and the server's part of it
(world_spec.py, serve.py, served_world.py, state_file.py); run/: runs in the world and
their cameras; worlds/: the shipped YAML files.
"""
