"""What the robot is made of: values and pure geometry, which everything else may import."""
