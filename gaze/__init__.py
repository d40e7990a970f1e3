"""Pure gaze models: no clock, no I/O, no global dice; imports numpy and nothing else of ours."""
