"""The source of every kernel that the scenes use, to prove that moving modules about changes none.

    python tests/kernels/sources.py dump FILE.json [--limit N] [--cache DIR]
    python tests/kernels/sources.py compare A.json B.json

`dump` writes the kernels of the scenes of `scenes.py`; `compare` says which scenes have other kernels, and exits with 1
where any has.

The source is what Warp generates for the CPU: from it the compiler makes the program, and the source for CUDA comes from the
same tree of statements. It is compared without what does not reach the program: comments, which quote Python and its line
numbers, and the names of functions, structs and kernels, which hold hashes and counters. The options that a kernel is
compiled with stand above its source.
"""

import argparse
import difflib
import hashlib
import json
import multiprocessing
import re
import sys
import tempfile
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import warp as wp
from warp._src.context import ModuleBuilder, ModuleHasher

import wsph

sys.path.insert(0, str(Path(__file__).parent))
from scenes import all_scenes, kernels_of

PROCESSES = 2


def short(name: str) -> str:
    """What a function, struct or kernel is called in Python, of its name in the source: without what it is defined in, the
    hash or counter at its end, and with them its module."""
    return re.sub(r"_([0-9a-f]{7,}|\d+)$", "", name).rsplit("__", 1)[-1]


def normalised(source: str, names: Iterable[str]) -> str:
    """A source without comments and empty lines, in which each of `names` stands as its short name and a number: they are
    numbered as they appear, so that two that differ in their hash or counter alone stay two."""
    lines = [line.rstrip() for line in source.splitlines()]
    text = "\n".join(line for line in lines if line and not line.lstrip().startswith("//")) + "\n"
    longest_first = sorted(map(re.escape, names), key=len, reverse=True)
    given: dict[str, str] = {}
    used: dict[str, int] = {}

    def renamed(match: re.Match[str]) -> str:
        name = match["name"]
        if name not in given:
            given[name] = f"{short(name)}@{used.get(short(name), 0)}"
            used[short(name)] = used.get(short(name), 0) + 1
        return match["before"] + given[name] + match["after"]

    # What Warp puts around a name: the adjoint's, the struct of a kernel's arguments, the functions that a launch calls.
    around = rf"\b(?P<before>(?:adj_|wp_args_)*)(?P<name>{'|'.join(longest_first)})(?P<after>(?:_c(?:pu|uda)_\w+)?)\b"
    return re.sub(around, renamed, text) if longest_first else text


def source_of(kernel: wp.Kernel) -> str:
    """The normalised source of a kernel, whatever else its module holds, under its name and options. Compiles nothing."""
    module = kernel.module
    module.get_module_hash()  # which finds the values of wp.static that are only known here
    options = module.resolve_options(wp.config, block_dim=1) | {"output_arch": None}  # as they are loaded on a CPU
    builder = ModuleBuilder(module, options, hasher=ModuleHasher([kernel], options), target="cpu")
    names = [f.native_func for f in builder.functions] + [s.native_name for s in builder.structs]
    own = sorted((module.options | kernel.options).items())
    head = f"kernel {short(kernel.get_mangled_name())}\noptions {', '.join(f'{k}={v!r}' for k, v in own)}\n"
    return head + normalised(builder.codegen("cpu"), [*names, kernel.get_mangled_name()])


@cache
def _source(kernel: wp.Kernel) -> tuple[str, str]:
    text = source_of(kernel)
    return hashlib.sha256(text.encode()).hexdigest(), text


@cache
def _scenes() -> dict[str, Any]:
    return dict(all_scenes())


def _begin(folder: str) -> None:
    wp.config.kernel_cache_dir = folder
    wp.config.log_level = wp.LOG_WARNING
    # The set-up's kernels are compiled, and hardly run: what is compiled faster is set up sooner.
    wp.config.optimization_level = 0


def _used(name: str) -> tuple[str, dict[str, str], str]:
    """A scene, its kernels' sources by their hash, and why it is refused where it is."""
    try:
        return name, dict(_source(kernel) for kernel in kernels_of(_scenes()[name]())), ""
    except wsph.WsphError as error:
        return name, {}, str(error).splitlines()[0]


def dump(path: Path, limit: int | None, kept: Path | None) -> None:
    """Write the kernels of the scenes, of the first `limit` of them where it is given. Sources are generated every time;
    what the set-up runs is compiled into `kept`, or into a folder that does not stay."""
    names = list(_scenes())[:limit]
    found: dict[str, Any] = {"skipped": {}, "scenes": {}, "kernels": {}}
    with (
        tempfile.TemporaryDirectory() as folder,
        multiprocessing.get_context("spawn").Pool(PROCESSES, _begin, (str(kept or folder),)) as pool,
    ):
        for number, (name, sources, refusal) in enumerate(pool.imap(_used, names), 1):
            if refusal:
                found["skipped"][name] = refusal
            else:
                found["scenes"][name] = sorted(sources)
                found["kernels"] |= sources
            if number % 50 == 0:
                print(f"{number} of {len(names)} scenes", flush=True)
    path.write_text(json.dumps(found, indent=1, sort_keys=True) + "\n")
    for name, refusal in found["skipped"].items():
        print(f"skipped: {name}: {refusal}")
    print(f"{len(found['scenes'])} scenes, {len(found['skipped'])} skipped, {len(found['kernels'])} distinct kernels")


def first_difference(name: str, a: dict[str, Any], b: dict[str, Any]) -> Iterator[str]:
    """A unified diff of the first kernel of a scene that differs, beside the one of its name that is most like it."""
    hashes = [set(found["scenes"][name]) for found in (a, b)]
    before = sorted(a["kernels"][k] for k in hashes[0] - hashes[1])
    after = sorted(b["kernels"][k] for k in hashes[1] - hashes[0])
    old = before[0] if before else ""
    alike = [text for text in after if text.splitlines()[0] == old.partition("\n")[0]] or after or [""]
    new = max(alike, key=lambda text: difflib.SequenceMatcher(None, old, text).quick_ratio())
    return difflib.unified_diff(old.splitlines(), new.splitlines(), "before", "after", lineterm="", n=5)


def compare(a: dict[str, Any], b: dict[str, Any]) -> int:
    """Print how the kernels of two dumps differ; 1 where they do."""
    names = [*a["scenes"], *a["skipped"], *b["scenes"], *b["skipped"]]
    differ = [name for name in dict.fromkeys(names) if a["scenes"].get(name) != b["scenes"].get(name)]
    for name in differ:
        kinds = [f"{len(d['scenes'][name])} kernels" if name in d["scenes"] else "skipped" if name in d["skipped"] else "absent" for d in (a, b)]  # fmt: skip
        print(f"differs: {name}: {kinds[0]} before, {kinds[1]} after")
    both = [name for name in differ if name in a["scenes"] and name in b["scenes"]]
    if both:
        print(f"\n{both[0]}:")
        print("\n".join(first_difference(both[0], a, b)))
    count = f"{len(a['scenes'])} scenes, {len(a['kernels'])} distinct kernels"
    print(f"{count}: {f'{len(differ)} scenes differ' if differ else 'equal'}")
    return int(bool(differ))


def main() -> int:
    """Dump or compare."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    dumping = commands.add_parser("dump")
    dumping.add_argument("file", type=Path)
    dumping.add_argument("--limit", type=int, help="only so many scenes")
    dumping.add_argument("--cache", type=Path, help="folder for compiled kernels, from which a later dump is quicker")
    comparing = commands.add_parser("compare")
    comparing.add_argument("files", type=Path, nargs=2)
    chosen = parser.parse_args()
    if chosen.command == "compare":
        a, b = (json.loads(path.read_text()) for path in chosen.files)
        return compare(a, b)
    dump(chosen.file, chosen.limit, chosen.cache)
    return 0


if __name__ == "__main__":
    sys.exit(main())
