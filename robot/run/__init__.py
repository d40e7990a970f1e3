"""Assembly and execution of a run."""
