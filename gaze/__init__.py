"""Pure gaze models: no clock, no I/O, no global random state; they import numpy only."""
