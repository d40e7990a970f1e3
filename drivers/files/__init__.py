"""Files of users: read with limits, written whole or not at all, films and MCAP."""
