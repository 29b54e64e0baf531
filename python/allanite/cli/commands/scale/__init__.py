"""Commands for many logs, and for logs that grow."""
