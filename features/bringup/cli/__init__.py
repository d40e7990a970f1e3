"""Commands of bring-up, with their options, ports and questions."""
