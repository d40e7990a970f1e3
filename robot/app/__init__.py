"""Where the parts of a run are put together, and run."""
