"""Capabilities besides the control of a head: each is one folder, and the core imports none.

A feature registers its commands and file schemas by entry points (``gazerig.drivers.plugins``),
like other packages. Its tests are in a folder of the same name in ``tests/features/``. Without
both folders the rest works; ``study`` needs ``lab``, and ``world`` to render films.
"""
