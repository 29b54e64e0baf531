"""What every room uses: errors, units, numbers as they are read, checks of what was asked for."""
