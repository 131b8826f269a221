"""Parquet files, written in shards, a group of rows at a time, with pictures inside."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from er_gym.data.exports.base import needs

_GROUP_BYTES = 32 << 20
"""Rows are kept in memory until their pictures have so many bytes."""
_SHARD_BYTES = 512 << 20


class ParquetShards:
    """The Parquet files of one split.

    Args:
        folder: where to.
        name: the files are ``NAME-00000.parquet`` and so on.
        schema: a ``pyarrow.Schema``.
    """

    def __init__(self, folder: Path, name: str, schema: Any) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder, self._name, self._schema = folder, name, schema
        self._rows: list[Mapping[str, Any]] = []
        self._held = self._written = self._shards = 0
        self._writer: Any = None

    def add(self, row: Mapping[str, Any], size: int) -> None:
        """Add a row.

        Args:
            row: its columns.
            size: the bytes of its pictures.
        """
        self._rows.append(row)
        self._held += size
        if self._held >= _GROUP_BYTES or len(self._rows) >= 256:
            self._flush()

    def close(self) -> None:
        """Write what is left."""
        self._flush()
        if self._writer is not None:
            self._writer.close()

    def _flush(self) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        if not self._rows:
            return
        if self._writer is not None and self._written >= _SHARD_BYTES:
            self._writer.close()
            self._writer, self._written = None, 0
        if self._writer is None:
            file = self._folder / f"{self._name}-{self._shards:05}.parquet"
            self._writer = pq.ParquetWriter(file, self._schema)
            self._shards += 1
        self._writer.write_table(pa.Table.from_pylist(self._rows, schema=self._schema))
        self._written += self._held
        self._rows, self._held = [], 0


def load_pyarrow() -> Any:
    """The module ``pyarrow``.

    Raises:
        ExportError: it is not installed.
    """
    try:
        import pyarrow
    except ImportError as error:
        raise needs("pyarrow", "data", error) from error
    return pyarrow
