"""Mouth: opening of a jaw from sound, with lips closed on b, m and p, and the sway of a speaker."""
