"""Commands for many logs, and for logs that do not end."""
