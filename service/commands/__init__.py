"""The commands of `rubscreen`, one file each; whatever is slow to import is imported when a command runs."""
