"""Bytes, lines and numbers of a file, whatever its format."""
