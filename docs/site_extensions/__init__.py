"""What this documentation needs beside Sphinx and MyST."""
