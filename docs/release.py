"""What must be so before a version is released; changes nothing."""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def problems(version: str) -> list[str]:
    """What speaks against releasing `version` now."""
    found = []
    if not re.fullmatch(r"\d+\.\d+\.\d+", version):
        return [
            f"VERSION={version!r}: three numbers are needed, such as 1.2.3 (semantic versioning)"
        ]
    crate = tomllib.loads((ROOT / "Cargo.toml").read_text())["package"]["version"]
    if crate != version:
        found.append(f'Cargo.toml says {crate}: set version = "{version}" and run cargo check')
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    if [p["version"] for p in lock if p["name"] == "allanite"] != [version]:
        found.append("Cargo.lock is of another version: run cargo check")
    if f"version: {version}\n" not in (ROOT / "CITATION.cff").read_text():
        found.append(f"CITATION.cff does not say version: {version}")
    first = re.search(r"^## (.*)$", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    if first is None or not re.fullmatch(rf"{re.escape(version)} \(\d{{4}}-\d\d-\d\d\)", first[1]):
        found.append(f"CHANGELOG.md does not begin with '## {version} (YYYY-MM-DD)'")
    # The README is the page on PyPI, where a path of the repository leads nowhere.
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"].get("urls", {})
    relative = re.findall(r"\]\((?!https?://)[^)]+\)", (ROOT / "README.md").read_text())
    if not urls:
        found.append("pyproject.toml has no [project.urls]: state the address of the repository")
    if relative:
        found.append(f"README.md has {len(relative)} relative links: make them absolute")
    return found


if __name__ == "__main__":
    found = problems(sys.argv[1] if len(sys.argv) > 1 else "")
    print("\n".join(found) or f"{sys.argv[1]}: the files agree")
    sys.exit(1 if found else 0)
