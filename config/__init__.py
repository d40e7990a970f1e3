"""Strict reading of YAML into frozen values, and the shipped rigs, profiles and scanpaths."""
