"""OAK-D cameras through depthai."""
