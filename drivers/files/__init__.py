"""Files of users: limited reads, atomic writes, films and MCAP."""
