"""Measurement of recorded and simulated gaze: report, compare, sweep, and fits to eye trackers.

Interface: the commands ``report``, ``sweep`` and ``fit-scanpath`` (commands.py);
``simulated_run.simulate`` returns the gaze trace of a simulated run, and ``measures.judge_run`` the
measures of a trace.

report/: measures, figures and the page of one run or of two; sweep/: many simulated runs;
analysis/: events in traces, ranges of people, eye-tracker recordings; cli/: the commands.
"""
