"""The tree runs no code that is not Python's import."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def test_the_tree_evaluates_no_text_and_unpickles_nothing() -> None:
    """Scenes, checkpoints and frames are data: no eval, exec, pickle, or array of objects anywhere in the packages."""
    files = [p for name in ("wsph", "integrators", "materials") for p in (ROOT / name).rglob("*.py")]
    assert {
        ROOT / "wsph" / "cli" / "entry.py",
        ROOT / "integrators" / "wsph_integrators" / "taylor.py",
        ROOT / "materials" / "wsph_materials" / "mises.py",
    } <= set(files)
    for path in files:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                called = ast.unparse(node.func)
                assert called not in ("eval", "exec", "compile", "__import__", "os.system", "yaml.load"), (path, called)
                assert not any(k.arg in ("allow_pickle", "shell") and ast.unparse(k.value) != "False" for k in node.keywords), path  # fmt: skip
            if isinstance(node, ast.Import | ast.ImportFrom):
                names = {getattr(node, "module", None), *(alias.name for alias in node.names)}
                assert not names & {"pickle", "marshal", "shelve", "dill", "joblib"}, (path, names)
