"""What the figures count, on files small enough to count by eye."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import measure
from import_graph import circles, module_graph, room_graph
from measure import Size
from mentions import PARTS, mentions
from syntax import module

KERNEL = "@cache\ndef made(space):\n    @kernel(ranged=True)\n    def push(first, a, b_out):\n        b_out[first] = a[first]\n\n    return push\n"


def test_folders_count_their_files_and_subfolders() -> None:
    paths = [
        "wsph/__init__.py",
        "wsph/cli.py",
        "wsph/parts/__init__.py",
        "wsph/parts/links.py",
        "wsph/parts/phase_field/field.py",
    ]
    found = measure.folders([module("", path) for path in paths])
    assert found == [Size(2, "wsph/"), Size(2, "wsph/parts/"), Size(1, "wsph/parts/phase_field/")]
    assert measure.top_modules([module("", path) for path in paths]) == ["wsph/cli.py"]


def test_lines_are_counted_from_def_to_the_end() -> None:
    each = module(KERNEL, "wsph/links.py")
    assert [item.size for item in measure.function_lengths([each])] == [6, 2]
    assert [item.size for item in measure.kernel_lengths([each])] == [2]
    assert [item.size for item in measure.kernel_arguments([each])] == [3]


def test_circles_are_found_between_modules_and_between_rooms() -> None:
    tree = [
        module("from wsph.scene.checks import check", "wsph/scene/tables.py"),
        module("if TYPE_CHECKING:\n    from wsph.scene import tables", "wsph/scene/checks.py"),
        module("from wsph.contact import law", "wsph/parts/links.py"),
        module("def f():\n    from .. import parts\n    from ..parts import links", "wsph/contact/law.py"),
    ]
    assert circles(module_graph(tree)) == [["wsph.scene.checks", "wsph.scene.tables", "wsph.scene.checks"]]
    assert circles(room_graph(tree)) == []
    assert circles(room_graph(tree, lazy=True)) == [["contact", "parts", "contact"]]


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("def f(a: Any, b: 'dict[str, Any]') -> list[typing.Any]: ...", 3),
        ("class A:\n    a: Any\n    _b: Any\n    def __init__(self, c: Any):\n        self.d: Any = c", 3),
        ("def _f(a: Any): ...\nclass _A:\n    a: Any\ndef g(a: Literal['a b']): ...", 0),
    ],
)
def test_any_is_counted_where_it_is_public(text: str, times: int) -> None:
    assert sum(item.size for item in measure.untyped([module(text, "wsph/links.py")])) == times


@pytest.mark.parametrize(
    ("text", "strict"),
    [
        ('"""Links."""\n\n# pyright: strict\n\nimport numpy', True),
        ("import numpy\n# pyright: strict", False),
        ("import numpy  # pyright: strict", False),
        ('"""\n# pyright: strict\n"""', True),
    ],
)
def test_a_file_is_strict_by_a_line_above_its_first_statement(text: str, strict: bool) -> None:
    assert measure.is_strict(module(text, "wsph/links.py")) == strict


def test_files_with_kernels_need_not_be_strict() -> None:
    tree = [module(text, "wsph/links.py") for text in (KERNEL, "@wp.func\ndef f(): ...", '"""Empty."""', "a = 1")]
    assert [each.text for each in measure.checkable(tree)] == ["a = 1"]


def test_lines_kept_from_the_formatter_are_comments() -> None:
    text = "a = [1,2]  # fmt: skip\nb = '# fmt: skip'\n# fmt: off\n"
    assert measure.unformatted([module(text, "wsph/links.py")]) == [Size(2, "wsph/links.py")]


def test_the_longest_contract_of_layers_counts() -> None:
    contracts = [{"type": "layers", "layers": ["a", "b | c"]}, {"type": "forbidden"}]
    assert measure.layers({"tool": {"importlinter": {"contracts": contracts}}}) == 2
    assert measure.layers({}) == 0


# A part, what names it, and whether that counts.
MENTIONS = [
    ("viscosity", "def f(): return system.viscous", True),
    ("viscosity", "make(viscosity=1)", True),
    ("viscosity", "from wsph.parts.viscosity import push", True),
    ("viscosity", "class ViscousPush: ...", True),
    ("viscosity", '"""viscosity"""\na = 1  # viscosity\n"""viscous"""', False),
    ("viscosity", "viscoplastic = 1", False),
    ("phase field", "if model in ('AT1', 'AT2'): ...", True),
    ("phase field", "f'bodies.{k}.phase-field'", True),
    ("links", "path.unlink(missing_ok=path.is_symlink())\nprint('a symbolic link')", False),
    ("links", "body.links", True),
    ("artificial stress", "'artificial viscosity'", False),
    ("artificial stress", "parts.artificial", True),
    ("residual", "COLUMNS = ['kinetic', 'hourglass', 'residual']\nenergy['residual'] / summary.energy['residual']", False),
    ("residual", "row(kinetic=1, residual=2)\nd = {'kinetic': 1, 'residual': 2}\nenergy_residual = 3", False),
    ("residual", "row(kinetic=1, residual=self.residual)", True),
    ("residual", "PARTS = ['viscosity', 'residual']", True),
    ("residual", "def largest_growth():\n    residual = 1", False),
    ("residual", "body['residual']", True),
]  # fmt: skip


@pytest.mark.parametrize(("name", "text", "counts"), MENTIONS)
def test_a_part_is_named_in_code_or_not(name: str, text: str, counts: bool) -> None:
    part = next(part for part in PARTS if part.name == name)
    found, users = mentions([module(text, "wsph/simulation/run.py")], part)
    assert (bool(found), users) == (counts, [])


def test_a_parts_own_room_and_the_contract_are_not_counted_and_users_stand_apart() -> None:
    paths = ["wsph/parts/links.py", "wsph/protocols.py", "wsph/validation/case.py", "wsph/scene/tables.py"]
    found, users = mentions([module("links = 1", path) for path in paths], next(p for p in PARTS if p.name == "links"))
    assert [text.partition(":")[0] for text in found] == ["wsph/scene/tables.py"]
    assert [text.partition(":")[0] for text in users] == ["wsph/validation/case.py"]
