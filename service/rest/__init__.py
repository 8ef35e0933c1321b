"""HTTP around the screening: bodies read, limits kept, answers and errors written."""
