"""Mouth: opening of a jaw from sound, with lips closed on b, m and p."""
