"""What people do at the page, checked and handed to the rig."""
