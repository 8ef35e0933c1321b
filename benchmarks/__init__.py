"""Long measurements: accuracy of the screening, and speed against the textbook method."""
