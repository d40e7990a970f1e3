"""What reaches a running rig from other programs and from its files."""
