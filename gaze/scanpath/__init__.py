"""Scanpath on a face: a Markov chain over eight parts with dwell times.

``scanpath.Scanpath`` is the walk; models holds the published tables, fit estimates them from
eye-tracker data. Nakamoto and Tsuruno, section 3.
"""
