"""The Zarr arrays of a store: a row a run, a chunk a task, every chunk with its check sum."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Any

from snapbeam.core.validate import InputError
from snapbeam.sweeps.compute.task import PointWork
from snapbeam.sweeps.compute.tasks import Stage
from snapbeam.sweeps.keep.durable import durable_write

if TYPE_CHECKING:
    from zarr.core.buffer import Buffer

__all__ = ["open_tables"]

_MISSING = "zarr is needed for --checkpoint: install snapbeam[cluster]"


def open_tables(folder: Path, stage: Stage, work: PointWork, read_only: bool = False) -> dict[str, Any]:
    """The arrays of a stage, made if they are not there; damaged descriptions are written again."""
    try:
        import zarr
    except ImportError as error:
        raise InputError(_MISSING) from error
    from zarr.storage import MemoryStore

    held: dict[str, Buffer] = {}
    fresh = MemoryStore(held)
    _create(fresh, stage, work)
    folder.mkdir(exist_ok=True)
    mode: Any = "r" if read_only else "r+"
    for key, value in held.items():
        path, data = folder / key, value.to_bytes()
        if not path.is_file() or path.read_bytes() != data:
            path.parent.mkdir(parents=True, exist_ok=True)
            durable_write(path, data)
    store = _durable_store(folder)
    return {
        name: zarr.open_array(store, path=f"{stage.name}/{name}", mode=mode, config=_CONFIG)
        for name in _tables(work)
    }


_CONFIG: Any = {"write_empty_chunks": True}


def _tables(work: PointWork) -> dict[str, tuple[str, tuple[str, ...]]]:
    return {"integers": ("int32", work.integers), "numbers": ("float64", work.numbers)}


def _create(store: Any, stage: Stage, work: PointWork) -> None:
    import zarr
    from zarr.codecs import Crc32cCodec, ZstdCodec

    zarr.create_group(store)
    zarr.create_group(store, path=stage.name, attributes={"parameter_hash": work.parameter_hash})
    for name, (kind, columns) in _tables(work).items():
        zarr.create_array(
            store,
            name=f"{stage.name}/{name}",
            shape=(stage.size, len(columns)),
            chunks=(stage.chunk, len(columns)),
            dtype=kind,
            compressors=[ZstdCodec(level=1), Crc32cCodec()],
            fill_value=0,
            chunk_key_encoding={"name": "default", "separator": "."},
            dimension_names=("run", "column"),
            attributes={"columns": list(columns)},
            config=_CONFIG,
        )


def _durable_store(folder: Path) -> Any:
    from zarr.storage import LocalStore

    class DurableStore(LocalStore):
        """A local store whose chunks are on the disk when a write returns."""

        async def set(self, key: str, value: Buffer) -> None:
            await asyncio.to_thread(durable_write, self.root / key, value.to_bytes())

        def set_sync(self, key: str, value: Buffer) -> None:
            durable_write(self.root / key, value.to_bytes())

    return DurableStore(folder)
