"""The description in the archives: the README, with links that also work outside the repository."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface


class ReadmeHook(MetadataHookInterface):
    """Make relative links absolute if ``[project.urls]`` has the address ``Source`` of the repository."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Set the description."""
        text = (Path(self.root) / "README.md").read_text(encoding="utf-8")
        source = metadata.get("urls", {}).get("Source")
        if source:
            text = re.sub(r"(!\[[^\]]*\]\()(?!https?:)", rf"\g<1>{source}/raw/v{metadata['version']}/", text)
            text = re.sub(r"(\]\()(?!https?:)", rf"\g<1>{source}/blob/v{metadata['version']}/", text)
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
