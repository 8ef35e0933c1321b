"""Backup of a service while it runs, and restore elsewhere: one tar file, every byte of it checked."""
