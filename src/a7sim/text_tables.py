"""Tables for a terminal: no borders, names left-aligned, numbers right-aligned."""

from collections.abc import Collection

from rich.table import Table


def text_table(*columns: str, left: Collection[int] = (0,), fold: Collection[int] = ()) -> Table:
    """Return an empty table of these columns;

    names in `left` are left-aligned; only columns in `fold` wrap their lines.
    """
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i in left else "right", no_wrap=i not in fold, overflow="fold")
    return table
