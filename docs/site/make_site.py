"""Gather the pages of the site in target/site-pages: those of docs/, and those made from the package itself."""

import re
import shutil
from pathlib import Path

import compared
import effect_pages
import format_pages
import notebook_pages
import reference_pages

ROOT = Path(__file__).parents[2]
PAGES = ROOT / "target" / "site-pages"


def copied() -> None:
    """Pages and pictures that are read in the repository too, with their links put right."""
    docs = ROOT / "docs"
    shutil.rmtree(PAGES, ignore_errors=True)
    PAGES.mkdir(parents=True)
    for page in docs.glob("*.md"):
        text = page.read_text(encoding="utf-8").replace("](../examples/", "](examples/")
        text = text.replace("](../ARCHITECTURE.md", "](ARCHITECTURE.md")
        text = re.sub(r"\]\((notebooks/[\w-]+)\.ipynb\)", r"](\1.md)", text)
        name = "index.md" if page.name == "start.md" else page.name
        (PAGES / name).write_text(text.replace("](start.md", "](index.md"), encoding="utf-8")
    for folder in ("figures", "screenshots", "gallery", "howto"):
        shutil.copytree(docs / folder, PAGES / folder)
    for page in (PAGES / "howto").glob("*.md"):
        text = page.read_text(encoding="utf-8")
        page.write_text(text.replace("](../start.md", "](../index.md"), encoding="utf-8")
    shutil.copytree(ROOT / "examples", PAGES / "examples", ignore=shutil.ignore_patterns("__*"))
    for name in ("CONTRIBUTING.md", "ARCHITECTURE.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        (PAGES / name).write_text(text.replace("](docs/", "]("), encoding="utf-8")


def navigation() -> str:
    """The configuration, with the generated pages in place of their folders."""
    text = (Path(__file__).parent / "mkdocs.yml").read_text(encoding="utf-8")
    for folder in ("effects", "api"):
        names = sorted(p.stem for p in (PAGES / folder).glob("*.md") if p.stem != "index")
        lines = "".join(f"\n{' ' * 10}- {folder}/{name}.md" for name in ("index", *names))
        text = text.replace(f": {folder}/\n", f":{lines}\n")
    return text.replace("../../target/", "")


def main() -> None:
    """All pages, then the configuration beside them."""
    copied()
    effect_pages.write(PAGES / "effects")
    notebook_pages.write(ROOT / "docs" / "notebooks", PAGES / "notebooks")
    reference_pages.write(PAGES)
    format_pages.write(PAGES / "formats.md")
    compared.write(PAGES / "compared.md")
    (ROOT / "target" / "mkdocs.yml").write_text(navigation(), encoding="utf-8")


if __name__ == "__main__":
    main()
