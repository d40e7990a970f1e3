"""Oculomotor control: saccades, pursuit, vergence, VOR and the head's share.

``oculomotor.Oculomotor`` turns a target into joint angles at every tick. Mitake et al., section 5;
Nakamoto and Tsuruno, section 3.3.
"""
