"""The chart page: static files that a browser runs, served by the service itself."""
