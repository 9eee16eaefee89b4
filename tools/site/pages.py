"""Hooks of the documentation site: pages and pictures that live outside of docs/, and the links to and from them.

The texts of the repository link to each other by relative paths that work on a code host. On the site, docs/ is the
root, and the pages of experiments, the derivation and CONTRIBUTING.md are added beside it.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path, PurePosixPath

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).resolve().parents[2]
OUTSIDE = ("experiments/*/README.md", "experiments/*/*.png", "experiments/*/*.gif", "adjoint/*.md", "CONTRIBUTING.md")
TARGET = r"\(([^)\s#]+)(#[^)\s]*)?\)"


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Adds the pages and pictures that live outside of docs/."""
    for pattern in OUTSIDE:
        for path in sorted(ROOT.glob(pattern)):
            name = path.relative_to(ROOT).as_posix()
            files.append(File(name, str(ROOT), config.site_dir, config.use_directory_urls))
    for path in sorted((ROOT / "docs").glob("notebooks/*.ipynb")):
        files.append(File.generated(config, f"notebooks/{path.stem}.md", content=as_text(path)))
    return files


def as_text(notebook: Path) -> str:
    """A notebook as Markdown: its texts, and its code in blocks."""
    parts = [f"[Download this notebook]({notebook.name}) and run it in a copy of the repository."]
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
    return "\n\n".join([parts[1], parts[0], *parts[2:]]) + "\n"


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Turns links between files of the repository into links between pages of the site.

    Of a link to a file that no page shows, the words remain.
    """
    if page.file.abs_src_path is None:  # made of a notebook
        return markdown
    here = Path(page.file.abs_src_path).parent
    folder = PurePosixPath(page.file.src_uri).parent

    def on_site(target: str) -> str | None:
        """The target as the site names it; None where the site does not have it."""
        if re.match(r"\w+:", target):
            return target
        name = Path(os.path.normpath(here / target)).relative_to(ROOT).as_posix()
        name = "index.md" if name == "README.md" else name.removeprefix("docs/").replace(".ipynb", ".md")
        return os.path.relpath(name, folder) if files.get_file_from_path(name) else None

    def without_link(found: re.Match[str]) -> str:
        return found.group() if on_site(found[2]) else found[1]

    def relinked(found: re.Match[str]) -> str:
        return f"]({on_site(found[1]) or found[1]}{found[2] or ''})"

    return re.sub(rf"\]{TARGET}", relinked, re.sub(rf"(?<!!)\[([^\[\]]*)\]{TARGET}", without_link, markdown))
