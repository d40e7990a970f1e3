"""A study between gazes: its design, the order of trials, its records and their statistics."""
