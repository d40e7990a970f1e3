"""Child processes and threads: start and end, messages, calls with a time limit."""
