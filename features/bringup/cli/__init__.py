"""The commands of bring-up, their options, ports and questions."""
