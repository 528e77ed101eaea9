"""Files that a page gives: made beside the page, handed to the browser, never written where a page says."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bokeh.models import ColumnDataSource, CustomJS

__all__ = ["Downloads", "drawing", "file_bytes"]

drawing = threading.RLock()
"""Held while Matplotlib draws, which one thread at a time may do."""
_SAVE = """
const bytes = source.data.bytes;
if (!bytes.length) { return; }
const link = document.createElement('a');
link.href = URL.createObjectURL(new Blob([Uint8Array.from(bytes)], {type: source.tags[1]}));
link.download = source.tags[0];
document.body.appendChild(link);
link.click();
link.remove();
setTimeout(() => URL.revokeObjectURL(link.href), 10000);
"""
_KINDS = {
    ".png": "image/png", ".pdf": "application/pdf", ".svg": "image/svg+xml", ".mp4": "video/mp4",
    ".gif": "image/gif", ".nc": "application/x-netcdf", ".toml": "application/toml", ".py": "text/x-python",
}  # fmt: skip


class Downloads:
    """The way of files to the browser."""

    def __init__(self) -> None:
        self.source = ColumnDataSource({"bytes": np.zeros(0, dtype=np.uint8)}, tags=["", ""], name="download")
        self.source.js_on_change("data", CustomJS(args={"source": self.source}, code=_SAVE))

    def give(self, name: str, content: bytes) -> None:
        """Hand a file to the browser; on the page's own thread."""
        self.source.tags = [name, _KINDS.get(Path(name).suffix, "application/octet-stream")]
        self.source.data = {"bytes": np.frombuffer(content, dtype=np.uint8).copy()}


def file_bytes(suffix: str, write: Callable[[Path], object]) -> bytes:
    """What ``write(path)`` writes to a file of its own, which is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="snapbeam-") as folder:
        path = Path(folder) / f"file{suffix}"
        write(path)
        return path.read_bytes()
