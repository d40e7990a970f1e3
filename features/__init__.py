"""Capabilities besides the control of a head: each is one folder, and the core imports none.

A feature registers its commands and file schemas by entry points (``gazerig.drivers.plugins``),
like other packages. Its tests are in ``tests/`` and its pages in ``docs/``, in folders of the same
name. Without these folders the rest works; ``study`` needs ``lab``, and ``world`` to render films.
"""
