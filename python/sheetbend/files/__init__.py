"""Files that anybody may have written: names, doors, bounds, JSON, and files that are written whole or not at all."""
