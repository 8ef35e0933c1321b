"""What the service remembers: rows in SQLite or PostgreSQL, one file a subject."""
