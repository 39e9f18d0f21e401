"""Rules of the house, held by every file of it; and that each would notice a breach."""

import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import house_rules as house
import kernel_rules as kernel
from syntax import ROOT, Module, module, modules, modules_in

Rule = Callable[[Module], Iterator[str]]


def breaches(rule: Rule, tree: Iterable[Module]) -> str:
    """What breaks a rule, a line each, in the order of the files; empty where nothing does."""
    return "\n".join(text for each in tree for text in sorted(rule(each), key=lambda text: int(text.split(":")[1])))


def test_what_a_kernel_writes_ends_in_out() -> None:
    found = breaches(kernel.writes_are_marked, modules())
    assert not found, found


def test_outputs_come_last_among_the_arguments_of_a_kernel() -> None:
    found = breaches(kernel.outputs_come_last, modules())
    assert not found, found


def test_a_kernel_is_split_over_threads_if_and_only_if_it_begins_with_first() -> None:
    found = breaches(kernel.split_kernels_begin_with_first, modules())
    assert not found, found


def test_one_file_alone_makes_kernels() -> None:
    found = breaches(kernel.one_file_makes_kernels, modules())
    assert not found, found


def test_nothing_reads_a_foreign_private_name() -> None:
    found = breaches(house.no_foreign_private_names, modules("wsph"))
    assert not found, found


def test_what_a_plugin_has_is_asked_in_one_room() -> None:
    found = breaches(house.no_probes, modules("wsph"))
    assert not found, found


def test_nothing_asks_which_formulation_it_has() -> None:
    found = breaches(house.no_questions_for_the_formulation, modules("wsph"))
    assert not found, found


def test_the_backend_knows_no_other_room() -> None:
    assert any(each.name.startswith(house.BACKEND) for each in modules("wsph")), f"there is no {house.BACKEND}"
    found = breaches(house.the_backend_knows_no_other_room, modules("wsph"))
    assert not found, found


def test_plugins_use_public_names_alone() -> None:
    third_parties = [
        each for init in (ROOT / "tests" / "plugin").glob("*/__init__.py") for each in modules_in(init.parent)
    ]
    assert third_parties
    found = breaches(house.plugins_use_public_names, [*modules("wsph_integrators", "wsph_materials"), *third_parties])
    assert not found, found


KERNEL = "@{decorator}\ndef push({arguments}):\n    i = first + wp.tid()\n    {line}\n"


def push(
    line: str = "f_out[i] = a[i]", arguments: str = "first, a, f_out", decorator: str = "kernel(ranged=True)"
) -> str:
    """A kernel that keeps all rules, but for what is said."""
    return KERNEL.format(line=line, arguments=arguments, decorator=decorator)


# A rule, the file that something stands in, and what breaks the rule there.
BREACHES: list[tuple[Rule, str, str]] = [
    (kernel.writes_are_marked, "wsph/links.py", push("a[i] = 0.0")),
    (kernel.writes_are_marked, "wsph/links.py", push("a[i] += 1.0", decorator='wp.kernel(module="unique")')),
    (kernel.writes_are_marked, "wsph/links.py", push("a.damage[i][0] = 1.0")),
    (kernel.writes_are_marked, "wsph/links.py", push("b = a.damage\n    b[i] = 1.0")),
    (kernel.writes_are_marked, "wsph/links.py", push("f_out[i], a[i] = 0.0, 1.0")),
    (kernel.writes_are_marked, "wsph/links.py", push("wp.atomic_add(a, i, 1.0)")),
    (kernel.outputs_come_last, "wsph/links.py", push(arguments="first, f_out, a")),
    (kernel.split_kernels_begin_with_first, "wsph/links.py", push(decorator="kernel")),
    (kernel.split_kernels_begin_with_first, "wsph/links.py", push(decorator="kernels.kernel(pairs=True)")),
    (kernel.split_kernels_begin_with_first, "wsph/links.py", push(arguments="a, first, f_out")),
    (kernel.split_kernels_begin_with_first, "wsph/links.py", push(decorator="kernel(ranged=form.points)")),
    (kernel.one_file_makes_kernels, "wsph/links.py", push(decorator="wp.kernel")),
    (kernel.one_file_makes_kernels, "wsph/links.py", "made = wp.kernel(enable_backward=False)(push)"),
    (kernel.one_file_makes_kernels, "wsph/links.py", "from warp import kernel"),
    (house.no_foreign_private_names, "wsph/links.py", "def f(system):\n    return system._weight"),
    (house.no_foreign_private_names, "wsph/links.py", "def f(self):\n    return self.system._weight"),
    (house.no_foreign_private_names, "wsph/links.py", "from wsph.state import _layout"),
    (house.no_foreign_private_names, "wsph/links.py", "import wsph.state\nwsph.state._layout()"),
    (house.no_probes, "wsph/links.py", "hasattr(material, 'rate')"),
    (house.no_probes, "wsph/links.py", "getattr(self.material, 'linear', False)"),
    (house.no_questions_for_the_formulation, "wsph/links.py", "isinstance(system, OneSetSystem)"),
    (house.no_questions_for_the_formulation, "wsph/links.py", "issubclass(kind, (str, lagrangian.PointSystem))"),
    (house.no_questions_for_the_formulation, "wsph/links.py", "if name == 'stress-points': pass"),
    (house.no_questions_for_the_formulation, "wsph/links.py", "if name not in ('small-strain', 'else'): pass"),
    (house.no_questions_for_the_formulation, "wsph/links.py", "match name:\n    case 'small-strain': pass"),
    (house.the_backend_knows_no_other_room, "wsph/backend/graph.py", "from wsph.scene import Scene"),
    (house.the_backend_knows_no_other_room, "wsph/backend/graph.py", "def f():\n    import wsph.parts.links"),
    (house.the_backend_knows_no_other_room, "wsph/backend/graph.py", "from wsph import scene"),
    (house.the_backend_knows_no_other_room, "wsph/backend/graph.py", "from ..scene import Scene"),
    (house.plugins_use_public_names, "wsph_maxwell/material.py", "from wsph.backend.space import Space"),
    (house.plugins_use_public_names, "wsph_maxwell/material.py", "import wsph"),
    (house.plugins_use_public_names, "wsph_maxwell/material.py", "from wsph import scene"),
]

# The same, where it is as it should be.
KEPT: list[tuple[Rule, str, str]] = [
    (kernel.writes_are_marked, "wsph/links.py", push()),
    (kernel.writes_are_marked, "wsph/links.py", push("m = a[i]\n    m[0, 0] = 1.0\n    f_out.damage[i] = m")),
    (kernel.writes_are_marked, "wsph/links.py", "@wp.func\ndef put(a, i):\n    a[i] = 0.0"),
    (kernel.outputs_come_last, "wsph/links.py", push()),
    (kernel.split_kernels_begin_with_first, "wsph/links.py", push()),
    (kernel.split_kernels_begin_with_first, "wsph/links.py", push(arguments="a, f_out", decorator="kernel()")),
    (kernel.split_kernels_begin_with_first, kernel.MAKER, push(decorator="wp.kernel")),
    (kernel.one_file_makes_kernels, "wsph/links.py", push()),
    (kernel.one_file_makes_kernels, kernel.MAKER, push(decorator="wp.kernel")),
    (house.no_foreign_private_names, "wsph/links.py", "def f(self):\n    return super()._n + self._n + cls._n"),
    (house.no_foreign_private_names, "wsph/links.py", "class A:\n    _n: int\ndef f(a):\n    return a._n"),
    (house.no_foreign_private_names, "wsph/links.py", "import os\nos._exit(1 + vector._length_)"),
    (house.no_probes, "wsph/links.py", "import os\nhasattr(os, 'sched_getaffinity')\ngetattr(self, name)"),
    (house.no_probes, "wsph/plugins/traits.py", "hasattr(material, 'rate')"),
    (house.no_questions_for_the_formulation, "wsph/links.py", "TABLE = {'small-strain': 2}\nisinstance(a, Scene)"),
    (house.no_questions_for_the_formulation, "wsph/formulations/table.py", "name == 'small-strain'"),
    (house.the_backend_knows_no_other_room, "wsph/backend/graph.py", "from wsph.errors import Refused\nimport numpy"),
    (house.the_backend_knows_no_other_room, "wsph/links.py", "from wsph.scene import Scene"),
    (
        house.plugins_use_public_names,
        "wsph_maxwell/material.py",
        "from wsph.stability.regions import margin\nimport wsph_other",
    ),
]


@pytest.mark.parametrize(("rule", "path", "text"), BREACHES)
def test_a_breach_is_found(rule: Rule, path: str, text: str) -> None:
    assert breaches(rule, [module(text, path)])


@pytest.mark.parametrize(("rule", "path", "text"), KEPT)
def test_what_keeps_a_rule_is_left_alone(rule: Rule, path: str, text: str) -> None:
    assert not breaches(rule, [module(text, path)])
