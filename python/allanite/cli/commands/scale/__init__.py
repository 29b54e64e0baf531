"""Commands for many logs and for growing logs; each module has a function `command`."""
