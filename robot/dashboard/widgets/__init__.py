"""Elements of the page's panels, the Python side."""
