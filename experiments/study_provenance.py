"""Where a result comes from: commit, versions, machine, options; stored with every result of the study."""
# pandas types every column as all that it might be.
# pyright: reportArgumentType=false, reportAttributeAccessIssue=false, reportCallIssue=false, reportIndexIssue=false
# pyright: reportGeneralTypeIssues=false, reportReturnType=false

import datetime
import importlib.metadata
import os
import pathlib
import platform
import subprocess
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

ROOT = pathlib.Path(__file__).resolve().parents[1]
PACKAGES = ("jax", "jaxlib", "equinox", "optax", "optimistix", "mujoco", "numpy", "scipy", "pandas", "pyarrow")


def made(options: dict[str, Any]) -> dict[str, Any]:
    """What a result is stored with.

    Args:
        options: What its script was told.
    """
    return {
        "commit": commit(), "date": datetime.datetime.now(datetime.UTC).strftime("%Y-%m-%d"),
        "python": platform.python_version(),
        "versions": {name: importlib.metadata.version(name) for name in PACKAGES},
        "machine": f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        "options": options,
    }  # fmt: skip


def store(frame: pd.DataFrame, path: pathlib.Path) -> None:
    """Write runs as Parquet, small enough to be kept under version control."""
    table = pa.Table.from_pandas(frame, preserve_index=False)
    # A mantissa's bytes apart from each other: the leading ones of like numbers are alike.
    floats = [f.name for f in table.schema if pa.types.is_floating(f.type)]
    others = [f.name for f in table.schema if f.name not in floats]
    part = path.with_suffix(".part")
    pq.write_table(
        table, part, compression="zstd", compression_level=19, use_dictionary=others, use_byte_stream_split=floats
    )
    part.replace(path)


def commit() -> str:
    """The commit that is checked out; marked where the code in the folder is not it."""
    git = lambda *words: subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True)  # noqa: E731
    told = git("rev-parse", "--short=12", "HEAD")
    if told.returncode:
        return "not under version control"
    changed = git("status", "--porcelain", "--", "experiments", "irb140_jax", "assets")
    return told.stdout.strip() + ", with changes" * bool(changed.stdout.strip())


def _processor() -> str:
    info = pathlib.Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    names = [line.split(":")[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or "unknown processor"
