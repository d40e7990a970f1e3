"""Attention: choice of the gaze target from bottom-up salience and top-down rules.

``attention.Attention`` chooses a target; it needs bottom_up, top_down, habituation and idle. Mitake
et al., sections 3 and 4.
"""
