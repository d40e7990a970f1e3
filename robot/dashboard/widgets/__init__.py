"""The elements of the page's panels, as this program holds them."""
