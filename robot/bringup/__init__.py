"""Getting a real rig to move for the first time, and keeping it well."""
