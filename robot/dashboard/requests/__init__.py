"""Input of the page's users, checked and sent to the rig."""
