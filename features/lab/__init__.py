"""Measurement of recorded and simulated gaze: report, compare, sweep, and fits to eye trackers.

Interface: the commands ``report``, ``compare``, ``sweep`` and ``fit-scanpath`` (commands.py);
``simulated_run.simulate`` returns the gaze trace of a simulated run, and ``report.make_report`` the
measures of a trace.

report/: measures, figures and pages of one run or of two; sweep/: many simulated runs over a grid,
a sample or a fit; analysis/: eye-tracker recordings and fits to them; cli/: the commands.
"""
