"""What a rig does not know of itself until it is measured: joints, camera, faces."""
