"""The rig as a body: links, joints, inertia and shapes, and the files that describe it."""
