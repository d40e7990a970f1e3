"""Capabilities beside the control of a head: each is one folder, and the core imports none.

A feature registers its commands and file schemas by entry points (``gazerig.drivers.plugins``), as
other packages do. Without its folder the rest works. ``study`` imports ``lab`` and ``world``.
"""
