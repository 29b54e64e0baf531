"""A file of results with one JSON line per case, so that an interrupted study keeps its results and continues."""

from __future__ import annotations

import json


class Results:
    """Rows of a file (in memory for None), to which a run adds rows; other `settings` than in the file are refused."""

    def __init__(self, path=None, settings=""):
        self.path, self.settings, self.rows = path, settings, {}
        for line in path.read_text().splitlines() if path and path.exists() else []:
            try:
                row = json.loads(line)
            except ValueError:
                # An interrupt cut the line off.
                continue
            if row["settings"] != settings:
                raise SystemExit(f"{path} has the settings {row['settings']!r}: name another file")
            self.rows[row["case"]] = row["result"]

    def of(self, case, run):
        """Result of a case: that of the file, or that of `run()`, which is written at once."""
        if case not in self.rows:
            self.rows[case] = run()
            if self.path:
                self._write({"case": case, "settings": self.settings, "result": self.rows[case]})
        return self.rows[case]

    def _write(self, row):
        cut_off = self.path.exists() and not self.path.read_bytes().endswith(b"\n")
        with self.path.open("a") as stream:
            stream.write("\n" * cut_off + json.dumps(row) + "\n")
