"""Jobs under measurement: how fast, how much memory, and what is left of them when processes are killed."""
