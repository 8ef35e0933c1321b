"""The witness tool: points of a map answered by the exact core, the surrogate and integration in time."""
