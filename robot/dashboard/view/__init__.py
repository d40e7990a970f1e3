"""What is drawn into the 3-D view: the head, people, fields of view, and from where it is seen."""
