"""What the comparison of sources takes for the same kernel, and what not; nothing is compiled."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from sources import compare, normalised, short

SOURCE = """
// {path}:{line}
static wp::float64 {module}law__locals__rate_{count}({params} p)
{{
    // return a * p.stiffness          <L {line}>
    return 0.1234567890 * p.stiffness;
}}
static wp::float64 law__locals__rate_{other}({params} p)
{{
    return adj_{params}() + {called}(p);
}}
static void flow_{hash}_cpu_kernel_forward(wp_args_flow_{hash} *args) {{}}
"""
HERE = {"path": "/here/laws.py", "line": 7, "module": "", "count": 0, "other": 1, "params": "Params_5fde1bb6",
        "called": "law__locals__rate_0", "hash": "eaefb8df"}  # fmt: skip
MOVED = {"path": "/there/materials/laws.py", "line": 31, "module": "wsph_materials__", "count": 12, "other": 3,
         "params": "Params_0a1b2c3d", "called": "wsph_materials__law__locals__rate_12", "hash": "01234567"}  # fmt: skip


def plain(facts: dict[str, object], change: tuple[str, str] = ("", "")) -> str:
    """The normalised source with those facts, after a change of its text."""
    names = ["law__locals__rate_{count}", "law__locals__rate_{other}", "{params}", "flow_{hash}"]
    names[0] = "{module}" + names[0]
    return normalised(SOURCE.format(**facts).replace(*change), [name.format(**facts) for name in names])


def test_names_of_modules_hashes_and_lines_are_struck_out() -> None:
    assert plain(HERE) == plain(MOVED)
    for word in ("here", "//", "__locals__", "5fde1bb6", "eaefb8df", "<L"):
        assert word not in plain(HERE)


@pytest.mark.parametrize(
    "change",
    [
        ("0.1234567890", "0.1234567891"),  # a number, which is no hash
        ("rate_0(p)", "rate_1(p)"),  # another function of the same name is called
        ("p.stiffness", "p.density"),
        ("static void", "static WP_NOINLINE void"),
    ],
)
def test_a_change_of_the_program_is_not(change: tuple[str, str]) -> None:
    assert plain(HERE, change) != plain(HERE)


def test_short_names() -> None:
    assert short("Kernels____init____locals__half_step_3de98794") == "half_step"
    assert short("packing__locals__unpack_0") == "unpack"
    assert short("Fields_cb65943b") == "Fields"


def test_comparing(capsys: pytest.CaptureFixture[str]) -> None:
    def found(text: str) -> dict[str, dict[str, object]]:
        return {"scenes": {"bar": [text]}, "skipped": {"beam": "refused"}, "kernels": {text: f"kernel flow\n{text}\n"}}

    assert compare(found("a"), found("a")) == 0
    assert "1 scenes, 1 distinct kernels: equal" in capsys.readouterr().out
    assert compare(found("a"), found("b")) == 1
    said = capsys.readouterr().out
    assert "differs: bar" in said
    assert "\n-a\n+b\n" in said
    assert compare(found("a"), found("a") | {"scenes": {}}) == 1
