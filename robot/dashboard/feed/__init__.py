"""Data of the rig for the page, from the loop's thread to the page's process."""
