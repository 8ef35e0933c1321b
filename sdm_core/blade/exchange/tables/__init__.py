"""CSV tables: matrices with their companions, and modal data."""
