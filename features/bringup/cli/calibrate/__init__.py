"""The commands that calibrate joints, camera and face."""
