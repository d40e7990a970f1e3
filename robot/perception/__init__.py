"""From what a camera gives to people and things placed in the world."""
