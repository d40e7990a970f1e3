"""Elements of the page's panels on the side of Python."""
