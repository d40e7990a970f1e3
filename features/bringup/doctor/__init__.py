"""What is wrong with a rig, and the remedy."""
