"""The commands report, compare, sweep and fit-scanpath."""
