"""The markers of pages, `<!-- NAME -->` and `<!-- /NAME -->`, between which scripts write."""

from collections.abc import Iterable


def between(page: str, name: str, rows: Iterable[str]) -> str:
    """The text of a page with rows between the markers of a name."""
    before, rest = page.split(f"<!-- {name} -->\n", 1)
    _, after = rest.split(f"<!-- /{name} -->", 1)
    return f"{before}<!-- {name} -->\n" + "\n".join(rows) + f"\n<!-- /{name} -->{after}"
