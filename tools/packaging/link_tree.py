"""The package's own files, and its tree in a development install: links into the checkout, in `build/dev`.

The wheel has the checkout's folders inside one package, `gnss_hil`. A development install has the same tree
as links, and a path file that names `build/dev`: what is imported, what an editor opens and what a type
checker reads is the checkout itself, and new files are there at once.
"""

from __future__ import annotations

from pathlib import Path

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

OWN = {
    "__init__.py": "tools/packaging/package.py",
    "__init__.pyi": "tools/packaging/package.pyi",
    "py.typed": "tools/packaging/py.typed",
    "contract.md": "docs/contract.md",
}
"""File of the package itself -> place in the checkout. The interface document is made of contract.md."""

FOLDERS = ("dbc", "emulator", "flightsw", "tools")


class LinkTree(BuildHookInterface):
    PLUGIN_NAME = "link-tree"

    def initialize(self, version: str, build_data: dict) -> None:
        if version == "editable":
            link(Path(self.root))
        elif self.target_name == "wheel":
            build_data["force_include"].update({place: f"gnss_hil/{name}" for name, place in OWN.items()})


def link(root: Path) -> None:
    """Lay the links, replacing those of an earlier install."""
    package = root / "build" / "dev" / "gnss_hil"
    package.mkdir(parents=True, exist_ok=True)
    for name, place in (OWN | {name: name for name in FOLDERS}).items():
        at = package / name
        at.unlink(missing_ok=True)
        at.symlink_to(Path("../../..") / place)
