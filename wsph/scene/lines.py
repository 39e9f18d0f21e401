"""Lines of the keys in a TOML text, for messages: TOML readers do not tell them."""

# pyright: strict

import re

_STRING = re.compile(r'"""|\'\'\'|"(?:\\.|[^"\\])*"|\'[^\']*\'')


def lines(text: str) -> dict[str, int]:
    """Line of every table header and key, by dotted path; entries of lists of tables are numbered."""
    found: dict[str, int] = {}
    counts: dict[str, int] = {}
    table, depth = "", 0
    for number, line in enumerate(text.splitlines(), 1):
        # Strings and comments hold neither keys nor brackets; a quoted key keeps its name.
        code = _STRING.sub(lambda m: m[0].strip("\"'") if m[0].strip("\"'").isidentifier() else "_", line)
        code = code.split("#", 1)[0].strip()
        if depth == 0 and code.startswith("["):
            name = code.split("]", 1)[0].lstrip("[").strip()
            parent, _, last = name.rpartition(".")
            prefix = f"{parent}.{counts[parent]}." if parent in counts else (f"{parent}." if parent else "")
            if code.startswith("[["):
                counts[name] = counts.get(name, -1) + 1
                table = f"{prefix}{last}.{counts[name]}"
            else:
                table = f"{prefix}{last}"
            found[table] = number
            continue
        if depth == 0 and "=" in code:
            key = code.split("=", 1)[0].strip()
            found[f"{table}.{key}" if table else key] = number
        depth = max(depth + sum(code.count(c) for c in "[{") - sum(code.count(c) for c in "]}"), 0)
    return found


def line_of(found: dict[str, int], key: str) -> int:
    """The line of a key, or of the nearest table around it; 0 where there is none."""
    while key and key not in found:
        key = key.rpartition(".")[0]
    return found.get(key, 0)
