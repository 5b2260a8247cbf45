"""Failure rates as tables: one row for each group, the last one for all."""

import csv
import io
from collections.abc import Iterator

from stillroom.documents.fleet import FailedRows, Measures, RateRow, RatesDocument
from stillroom.errors import Unavailable

Cell = str | int | float | bool | None


def rows(found: RatesDocument) -> Iterator[dict[str, Cell]]:
    """By the names of the columns: of each measure its count, rate, the ends of the interval and the design effect."""
    for row in [*found.items, found.total] if found.group_by is not None else [found.total]:
        yield _cells(row)


def _cells(row: RateRow) -> dict[str, Cell]:
    cells: dict[str, Cell] = {name: getattr(row, name) for name in ("key", "missions", "robots", "sufficient")}
    for name in Measures.model_fields:
        low, high = getattr(row.ci95, name)
        cells |= {
            f"{name}_count": getattr(row.failed if name in FailedRows.model_fields else row, name),
            f"{name}_rate": getattr(row.rates, name),
            f"{name}_low": low,
            f"{name}_high": high,
            f"{name}_effect": getattr(row.design_effect, name),
        }
    return cells


def as_csv(found: RatesDocument) -> str:
    text = io.StringIO()
    table = list(rows(found))
    writer = csv.DictWriter(text, list(table[0]), lineterminator="\r\n")
    writer.writeheader()
    writer.writerows(row | {"key": _plain(str(row["key"]))} for row in table)
    return text.getvalue()


def _plain(text: str) -> str:
    """Spreadsheets take what begins like this for a formula; robots say what their firmware is called."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text


def as_parquet(found: RatesDocument) -> bytes:
    """Raises Unavailable where pyarrow is not installed."""
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise Unavailable("This service was installed without Parquet: pip install 'stillroom[parquet]'.") from None
    table = list(rows(found))
    types = {"key": pa.string(), "sufficient": pa.bool_()}
    columns = [
        (
            name,
            types.get(name, pa.int64() if name.endswith("_count") or name in ("missions", "robots") else pa.float64()),
        )
        for name in table[0]
    ]
    content = io.BytesIO()
    parquet.write_table(pa.Table.from_pylist(table, schema=pa.schema(columns)), content)
    return content.getvalue()
