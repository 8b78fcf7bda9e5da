"""Checkpoints of a study: the whole tally as Parquet if pyarrow is installed, otherwise as NPZ."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

import a7sim
from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.study.quantile_sketch import Counts, QuantileSketch
from a7sim.study.tally import Tally

PARQUET, NPZ = "checkpoint.parquet", "checkpoint.npz"
KINDS = (PARQUET, NPZ)

RESUME_HINT = "the same command continues from the checkpoint (--out)"
"""Advice for a study that ended early."""

_NUMBERS = ("count", "origin", "total", "squares", "low", "high")
_WHOSE = ("software", "identity")


@dataclass(frozen=True)
class _Ragged:
    """Lists of numbers of different lengths, one list per row, in one array."""

    values: Array
    ends: Counts
    """Start of each list, and the end of the last ``(rows + 1,)``."""

    @classmethod
    def of(cls, lists: Sequence[Array], kind: type) -> "_Ragged":
        ends = np.cumsum([0, *(each.size for each in lists)], dtype=np.int64)
        return cls(np.concatenate([np.zeros(0, dtype=kind), *lists]), ends)

    def __iter__(self) -> Iterator[Array]:
        return (self.values[begin:end] for begin, end in pairwise(self.ends.tolist()))


_Columns = Mapping[str, Any]


def checkpoint_path(folder: Path) -> Path:
    """Return the path of the checkpoint in a folder; the format depends on the installed libraries."""
    return folder / (NPZ if find_spec("pyarrow") is None else PARQUET)


def newest_checkpoint(folder: Path) -> Path | None:
    """Return the newest checkpoint of any format in a folder; None if there is none."""
    existing = [folder / name for name in KINDS if (folder / name).exists()]
    return max(existing, key=lambda path: path.stat().st_mtime_ns, default=None)


def save(tally: Tally, path: Path, identity: str) -> None:
    """Write a tally atomically and remove checkpoints of other formats.

    The same tally gives the same bytes.
    """
    whose = dict(zip(_WHOSE, (a7sim.__version__, identity), strict=True))
    written = (_parquet if path.suffix == ".parquet" else _npz)(_columns(tally), whose)
    temporary = path.with_name(path.name + ".part")
    temporary.write_bytes(written)
    temporary.replace(path)
    for other in KINDS:
        if path.name in KINDS and other != path.name:
            path.with_name(other).unlink(missing_ok=True)


def load(path: Path, identity: str) -> Tally:
    """Return the tally written by `save`.

    Raises A7SimError if the file is damaged or is of another study or version.
    """
    if path.suffix == ".parquet" and find_spec("pyarrow") is None:
        raise A7SimError(f"{path}: expected pyarrow to read it (pip install 'a7sim[parquet]'; --force begins anew)")
    try:
        columns, whose = (_of_parquet if path.suffix == ".parquet" else _of_npz)(path)
        software, of = (whose[name] for name in _WHOSE)
        if (software, of) == (a7sim.__version__, identity):
            return _tally(columns)
    except (OSError, ValueError, KeyError, EOFError, TypeError, IndexError, BadZipFile) as error:
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise A7SimError(f"{path}: expected the checkpoint of a study, got a file that is none: {why}") from error
    if software != a7sim.__version__:
        asked = f"expected a checkpoint of a7sim {a7sim.__version__}, got one of {software}"
        raise A7SimError(f"{path}: {asked} (--force begins anew)")
    raise A7SimError(f"{path}: expected the checkpoint of this study, got that of another (--force begins anew)")


def _columns(tally: Tally) -> _Columns:
    """Return a tally as columns of a table with one row per cell and response."""
    cells, responses = tally.count.shape
    sketches = [sketch for row in tally.sketches for sketch in row]
    return {
        "cell": np.repeat(np.arange(1, cells + 1), responses),
        "response": np.tile(np.arange(1, responses + 1), cells),
        "replicates": np.repeat(tally.done, responses),
        **{name: getattr(tally, name).ravel() for name in _NUMBERS},
        "sample": _Ragged.of([each for cell in range(cells) for each in tally.sample(cell)], float),
        "sketch": _Ragged.of([sketch.values for sketch in sketches], float),
        "sketch_levels": _Ragged.of([np.array([each.size for each in one.levels], int) for one in sketches], int),
        "sketch_halved": _Ragged.of([np.array(one.halved, int) for one in sketches], int),
    }


def _tally(columns: _Columns) -> Tally:
    cells, responses = int(columns["cell"][-1]), int(columns["response"][-1])
    shape = (cells, responses)
    samples = list(columns["sample"])
    sketches = [
        QuantileSketch(list(np.split(values, np.cumsum(sizes)[:-1])) if sizes.size else [], halved.tolist())
        for values, sizes, halved in zip(
            columns["sketch"], columns["sketch_levels"], columns["sketch_halved"], strict=True
        )
    ]
    return Tally(
        columns["replicates"].reshape(shape)[:, 0].copy(),
        **{name: columns[name].reshape(shape).copy() for name in _NUMBERS},
        samples=[[np.stack(samples[row : row + responses])] for row in range(0, cells * responses, responses)],
        sketches=[sketches[row : row + responses] for row in range(0, cells * responses, responses)],
    )


def _npz(columns: _Columns, whose: Mapping[str, str]) -> bytes:
    arrays = {name: np.array(stated) for name, stated in whose.items()}
    for name, column in columns.items():
        if isinstance(column, _Ragged):
            arrays |= {f"{name}.values": column.values, f"{name}.ends": column.ends}
        else:
            arrays[name] = column
    held = BytesIO()
    np.savez(held, allow_pickle=False, **arrays)
    return held.getvalue()


def _of_npz(path: Path) -> tuple[_Columns, Mapping[str, str]]:
    with np.load(path, allow_pickle=False) as held:
        plain = {name: held[name] for name in held.files if "." not in name}
        ragged = {name.removesuffix(".ends") for name in held.files if name.endswith(".ends")}
        lists = {name: _Ragged(held[f"{name}.values"], held[f"{name}.ends"]) for name in ragged}
    return plain | lists, {name: str(plain[name]) for name in _WHOSE if name in plain}


def _parquet(columns: _Columns, whose: Mapping[str, str]) -> bytes:
    pa, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    arrays = {
        name: pa.LargeListArray.from_arrays(column.ends, column.values) if isinstance(column, _Ragged) else column
        for name, column in columns.items()
    }
    held = BytesIO()
    table = pa.table(arrays).replace_schema_metadata(dict(whose))
    parquet.write_table(table, held, compression="none", use_dictionary=False)
    return held.getvalue()


def _of_parquet(path: Path) -> tuple[_Columns, Mapping[str, str]]:
    pa, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    table = parquet.read_table(pa.BufferReader(path.read_bytes()), use_threads=False).combine_chunks()
    whose = {key.decode(): stated.decode() for key, stated in (table.schema.metadata or {}).items()}
    columns: dict[str, Any] = {}
    for name, column in zip(table.column_names, table.columns, strict=True):
        if pa.types.is_large_list(column.type):
            lists = column.combine_chunks()
            values = lists.flatten().to_numpy(zero_copy_only=False)
            columns[name] = _Ragged(values, lists.offsets.to_numpy() - lists.offsets[0].as_py())
        else:
            columns[name] = column.to_numpy()
    return columns, whose
