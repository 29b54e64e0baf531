"""Files of clocks: RINEX clock files, Stable32, TimeLab."""
