"""The screening service: REST, client, command line, charts."""
