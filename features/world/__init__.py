"""World with physics: a room with people, the rig in it, and the images of its camera.

Interface: the surroundings ``world`` (run/surroundings.py), for ``gazerig run --world``. It needs
MuJoCo, the extra ``world``.

In this folder: the acts of a script in time and their faults (timeline.py), the people's motion and
shape, the model for MuJoCo and its physics, the renderer, and the server's part of it
(world_spec.py, serve.py, served_world.py, state_file.py); run/: runs in the world and their
cameras; worlds/: the shipped scripts; rooms/: rooms as MJCF with textures, and their places.
"""
