"""Commissioning a rig: find, set up, examine, calibrate and move its servos, and watch them.

Interface: the commands ``scan``, ``setup``, ``doctor``, ``calibrate``, ``jog``, ``monitor`` and
``record-track`` (commands.py); ``servo_kinds.KINDS`` and ``doctor.servo_checks`` contain the
differences between servo families.

This folder has the operations of the commands: search, settings, slow motion, telemetry, recording
by hand. Subfolders: doctor/ for faults and their remedies; calibration/ for joints, linkages,
camera and face; cli/ for the commands.
"""
