"""Files: whole or not there."""

from pathlib import Path

import pytest

from wsph.errors import OutputError
from wsph.output.files import write_atomically


def test_a_failed_write_leaves_no_debris(tmp_path: Path) -> None:
    def fail(path: Path) -> None:
        path.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(OutputError, match="No space left"):
        write_atomically(tmp_path / "x.csv", fail)
    assert list(tmp_path.iterdir()) == []
