"""A study in which people rate two to six gazes: design, sessions, analysis.

Interface: the command ``study`` (commands.py); the types of the YAML files
(design.py); ``load_study`` reads a study. It needs the feature ``lab``, and ``world``
to render films. studies/ and questionnaires/ hold the shipped YAML files.
"""
