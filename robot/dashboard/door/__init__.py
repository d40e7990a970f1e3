"""Access of browsers to the page: admission, limits, and proxies of their connections."""
