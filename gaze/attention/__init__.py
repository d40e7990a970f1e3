"""What the head looks at: bottom-up attention against top-down rules, and what follows from it.

``attention.Attention`` chooses a target; it needs bottom_up, top_down, habituation and idle. Mitake
et al., sections 3 and 4.
"""
