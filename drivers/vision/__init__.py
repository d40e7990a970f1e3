"""What is seen in images."""
