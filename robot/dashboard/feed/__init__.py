"""What the page is told of the rig: from the loop's thread to the page's process."""
