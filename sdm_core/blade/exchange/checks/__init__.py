"""What imported data are checked for, and how it is said."""
