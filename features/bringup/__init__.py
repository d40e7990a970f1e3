"""Commissioning a rig: find, set up, examine, calibrate and move its servos, and watch them.

Interface: the commands ``scan``, ``setup``, ``doctor``, ``calibrate``, ``jog``, ``home``,
``look-at``, ``monitor``, ``reboot`` and ``record-gesture`` (commands.py); ``servo_families.KINDS``
and ``doctor.families.CHECKS`` have what differs between servo families.

In this folder: what commands do with servos: search, settings, slow motion, telemetry, recording
by hand; doctor/: faults and their remedies; calibration/: joints, linkages, camera, face; cli/:
the commands.
"""
