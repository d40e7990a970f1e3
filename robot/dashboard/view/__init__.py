"""3-D view: the head, people, fields of view, and viewpoints."""
