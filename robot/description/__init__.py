"""Description of a rig's body: links, joints, inertia and shapes, and the files that contain it."""
