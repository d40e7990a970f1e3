"""A study that is run: the head in a process of its own, films, and what is measured of trials."""
