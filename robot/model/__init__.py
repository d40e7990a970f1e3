"""Values and pure geometry of the robot, which every other module may import."""
