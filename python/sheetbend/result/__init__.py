"""What a fit gives back, as plain data."""
