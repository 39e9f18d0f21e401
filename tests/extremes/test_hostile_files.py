"""Hostile input to probes, files, folders, signals and threads: refused by name or right, never silent, never a traceback.

Each row of the table is a case: what is done in a folder of its own, the exit codes that are right, and words of the answer.
"""

import os
import re
import resource
import shutil
import signal
import subprocess
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import wsph
from tests.extremes.hostile import ALL, BODY, CASES, Answer, Hostile, case, named, probe, process, run, scene_case, told
from wsph.output.view.recorded import frames, words

# Probes.
scene_case(
    "a probe in millimetres",
    r"probes.0.at: \[\[500.0, 500.0\]\] does not lie in one body; 'b' reaches from \[0.0, 0.0\] to \[1.0, 1.0\] m",
    probe(at="[[500.0, 500.0]]"),
)
scene_case("a place with a unit of time", "probes.0.at.0.1: '1 s' is not in units of m", probe(at='[["10 mm", "1 s"]]'))
scene_case(
    "a cadence with a unit of length",
    "probes.0.every: '1 mm' is not in units of s",
    probe(at="[[0.5, 0.5]]", every='"1 mm"'),
)
scene_case("a place that is not a number", "probes.0.at.0.0: nan is not a finite number", probe(at="[[nan, 0.5]]"))
scene_case("a place without coordinates", r"probes.0.at: \[\] has 0 coordinates", probe(at="[[]]"))
scene_case(
    "a selection that is never true",
    "probes.0.where: .* selects no particle; 'b' reaches",
    probe(where='"x > sqrt(-1 - x)"', reduce='"max"'),
)
scene_case("a selection in millimetres", "'x > 500' selects no particle", probe(where='"x > 500"', reduce='"sum"'))
scene_case(
    "a stress where only nodes are",
    r"selects no place of 'stress', which stands at the points inside the cells",
    probe(where='"x <= 0"', reduce='"max"', fields='["stress_xx"]'),
)
scene_case(
    "a velocity where only stress points are",
    "selects no place of 'velocity', which stands at the particles",
    probe(where='"x > 0.1 and x < 0.2"', reduce='"max"', fields='["stress_xx", "velocity_x"]'),
)
scene_case(
    "two probes that differ by case",
    "probes.1.name: 'P' names another probe already",
    probe(at="[[0.5, 0.5]]") + '[[probes]]\nname = "P"\nat = [[0.5, 0.5]]\nfields = ["velocity_x"]\n',
)
scene_case(
    "a probe named as a path",
    r"probes.0.name: '../../p': .*a name has at most 100 of a to z",
    probe(name='"../../p"', at="[[0.5, 0.5]]"),
)
scene_case(
    "a probe on a crack",
    r"\[0.25, 0.5\] is on a crack, with a value on either side: name a point beside it",
    probe(at="[[0.25, 0.5]]").replace("spacing =", "cracks = [{ from = [0.0, 0.5], to = [0.5, 0.5] }]\nspacing ="),
)
scene_case(
    "a probe in a piece without cells",
    r"\[3.02, 3.02\] is too far from every place where 'velocity' stands",
    probe(at="[[3.02, 3.02]]").replace(
        '{ type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }',
        '{ type = "union", shapes = [{ type = "box", min = [0.0, 0.0], max = [1.0, 1.0] }, { type = "disc", center = [3.0, 3.0], radius = 0.05 }] }\nsurface = "stairs"',
    ),
)
scene_case(
    "a cadence of 2^60 steps",
    r"probes.0.every: 1152921504606846976 steps: from 1 to 2\^53",
    probe(at="[[0.5, 0.5]]", every=str(2**60)),
)
scene_case("a cadence of nothing", "probes.0.every: 0.0 is not above zero", probe(at="[[0.5, 0.5]]", every="0.0"))


@case("a cadence beyond the end: the first and the last state", "completed: 10 steps", 0)
def _(folder: Path) -> Answer:
    answer = run(folder, probe(at="[[0.5, 0.5]]", every="1e300"))
    assert len((folder / "out" / "probes" / "p.csv").read_text().splitlines()) == 3
    return answer


@case("a cadence of 1e-320 s: every state", "completed: 10 steps", 0)
def _(folder: Path) -> Answer:
    answer = run(folder, BODY + "[output]\nevery = 1e-320\nhistory = 5e-324\n")
    assert len(frames(folder / "out")) == len((folder / "out" / "history.csv").read_text().splitlines()) - 1 == 11
    return answer


# Names.
for text in (r'"a\u0000b"', r'"\u001b[31mred"', r'"two\nlines"', '" "', '""'):
    scene_case(f"a body named {text}", "bodies.0.name: .*a name has printed characters", named(text))


@case("a body with a name of signs: in the files as it is", "completed", 0)
def _(folder: Path) -> Answer:
    answer = run(folder, named('"<b>/.. & %s \\"ü\\" 力"'))
    mesh = pytest.importorskip("pyvista").read(folder / "out" / "frames" / "frame_000002.vtu")
    with np.load(folder / "out" / "frames" / "frame_000002.npz") as archive:
        assert words(mesh, "bodies")[0] == archive["bodies"][0] == '<b>/.. & %s "ü" 力'
    return answer


# Folders.
@case("a folder with a name of signs: its frames open", "completed", 0)
def _(folder: Path) -> Answer:
    name = "a b\n%20 ü'\"&<.pvd"
    answer = run(folder, BODY + ALL, out=name)
    assert told("view", folder / name, "--save", folder / "x.png").code == 0
    return answer


case("a folder that is a file", "is a file, not a folder")(lambda folder: run(folder, BODY, out="scene.toml"))
case("a folder below a file", "cannot be written: Not a directory")(
    lambda folder: run(folder, BODY, out="scene.toml/out")
)
case("a folder with a name too long", "cannot be written: File name too long")(
    lambda folder: run(folder, BODY, out="x" * 300)
)
case("a folder with a NUL", "has a NUL character")(lambda folder: run(folder, BODY, out="a\0b"))
case("a folder that takes no files", "/proc/out: cannot be written")(lambda folder: run(folder, BODY, out="/proc/out"))
case("the folder where one is", "holds files already")(lambda folder: told("run", _saved(folder), "-o", folder))


def _saved(folder: Path) -> Path:
    (folder / "scene.toml").write_text(BODY)
    return folder / "scene.toml"


@case("a folder that is taken away during the run", "", 2)
def _(folder: Path) -> Answer:
    scene = wsph.load(_saved(folder)).with_(output={"every": 2})
    with pytest.raises(wsph.OutputError, match=r"frame_\d{6}.vtu: cannot be written: No such file") as error:
        wsph.run(scene, folder / "out", progress=lambda *_: shutil.rmtree(folder / "out", ignore_errors=True))
    return Answer(2, str(error.value))


@case("a file where checkpoints go", "", 2)
def _(folder: Path) -> Answer:
    scene = wsph.load(_saved(folder)).with_(checkpoint={"every": 5}, output={"every": 2})
    with pytest.raises(wsph.OutputError, match=r"checkpoint_\d{12}.npz: cannot be written") as error:
        wsph.run(scene, folder / "out", progress=lambda *_: (folder / "out" / "checkpoints").touch())
    return Answer(2, str(error.value))


@case("three threads and one folder: one has it", "", 0)
def _(folder: Path) -> Answer:
    scene, found = wsph.load(_saved(folder)), list[str]()

    def one() -> None:
        try:
            found.append(wsph.run(scene, folder / "out", overwrite=False).status)
        except wsph.OutputError as error:
            found.append(str(error))

    threads = [threading.Thread(target=one) for _ in range(3)]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    assert sorted(each for each in found if each == "completed") == ["completed"]
    return Answer(0, "\n".join(found))


# Disks and pipes.
def full(kind: str) -> None:
    """A disk that is full at the first frame: named, nothing half written, and the folder can be used again."""

    def done(folder: Path) -> Answer:
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (8000, 8000))  # noqa: E731
        text = BODY.replace("spacing = 0.25", "spacing = 0.05") + f'[output]\nformats = ["{kind}"]\n'
        child = process(folder, text, preexec_fn=limit)
        said = child.communicate(timeout=120)[0]
        assert not [path for path in folder.rglob("*") if "partial" in path.name or path.name == ".lock"]
        assert run(folder, text, "--overwrite").code == 0
        return Answer(child.returncode, said)

    case(f"a full disk, {kind}", r"^error: .*frame_000000\.\w+: cannot be written: File too large$")(done)


for kind in ("vtu", "xdmf", "npz"):
    full(kind)


@case("standard output that is full", r"^error: .*No space left on device$", 1)
def _(folder: Path) -> Answer:
    with open("/dev/full", "w") as nowhere:
        child = process(folder, BODY, stdout=nowhere, stderr=subprocess.PIPE)
        said = child.communicate(timeout=120)[1]
        return Answer(child.returncode, said)


@case("standard output that nobody reads", "^$", 141)
def _(folder: Path) -> Answer:
    reader, writer = os.pipe()
    os.close(reader)
    child = process(folder, BODY, stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    said = child.communicate(timeout=120)[1]
    assert (folder / "out" / "summary.json").exists()
    return Answer(child.returncode, said)


# Signals.
def _wait_for_its_handlers(process_id: int) -> None:
    """Until the command catches SIGTERM: before that it is Python's own start, which answers as Python does."""
    status = Path(f"/proc/{process_id}/status")
    bit = 1 << (signal.SIGTERM - 1)
    started = time.monotonic()
    while time.monotonic() - started < 60.0:
        caught = re.search(r"^SigCgt:\s*(\w+)", status.read_text(), re.MULTILINE)
        if caught and int(caught[1], 16) & bit:
            return
        time.sleep(0.005)
    raise AssertionError("the command never set its handlers of signals")


def signalled(number: int, moment: float) -> None:
    """A signal to a run that has just begun, or some time later: a whole state, no debris, and it goes on."""

    def done(folder: Path) -> Answer:
        text = (
            BODY.replace("end = 0.2", "end = 200.0")
            + ALL.replace("every = 5", "every = 3")
            + "[checkpoint]\nevery = 50\n"
        )
        child = process(folder, text)
        started = time.monotonic()
        while moment and not (folder / "out" / "checkpoints").exists() and time.monotonic() - started < 60.0:
            time.sleep(0.005)
        if not moment:
            _wait_for_its_handlers(child.pid)
        time.sleep(moment or 0.05)
        child.send_signal(number)
        said = child.communicate(timeout=120)[0]
        assert not [path for path in folder.rglob("*") if "partial" in path.name or path.name == ".lock"]
        if (folder / "out").exists():
            assert told("view", folder / "out", "--save", folder / "x.png").code == 0
            assert (
                told("run", folder / "scene.toml", "-o", folder / "out", "--resume", "--set", "run.end=1e-3").code == 2
            )
        return Answer(child.returncode, said)

    name = signal.Signals(number).name
    # While modules are imported Python may die of SIGINT itself, when it has said so: a shell calls that 130 too.
    codes = (130,) if moment else (130, -number)
    case(f"{name} {'in the middle of a run' if moment else 'before anything is set up'}", "interrupted", *codes)(done)


signalled(signal.SIGINT, 0.0)
signalled(signal.SIGINT, 0.013)
signalled(signal.SIGTERM, 0.101)
signalled(signal.SIGHUP, 0.013)


# Files that are read.
@case("a list of frames with a time that is none", "frames.pvd: cannot be read")
def _(folder: Path) -> Answer:
    (folder / "frames.pvd").write_text('<DataSet timestep="np.float64(0.1)" file="frames/frame_000000.vtu"/>')
    return told("view", folder, "--save", folder / "x.png")


@case("a picture where no folder is", "x.png: cannot be written")
def _(folder: Path) -> Answer:
    assert run(folder, BODY).code == 0
    return told("view", folder / "out", "--save", folder / "nowhere" / "x.png")


@case("a scene that is no text", "scene.toml: cannot be read: 'utf-8'")
def _(folder: Path) -> Answer:
    (folder / "scene.toml").write_bytes(b"\xff\xfe\x00schema")
    return told("run", folder / "scene.toml")


@case("a study that is damaged, to go on", "holds no study")
def _(folder: Path) -> Answer:
    (folder / "study.toml").write_text(f'schema = 1\nscene = "{_saved(folder)}"\n')
    (folder / "out").mkdir()
    (folder / "out" / "study.json").write_text('{"rows": [')
    return told("study", folder / "study.toml", "-o", folder / "out", "--resume")


@case("a run that goes on in the folder of a study", "holds no run of wsph, so --resume finds nothing there")
def _(folder: Path) -> Answer:
    (folder / "out").mkdir()
    (folder / "out" / "study.json").write_text('{"title": "", "rows": [], "digests": []}')
    return run(folder, BODY, "--resume")


@pytest.mark.parametrize("each", CASES, ids=lambda each: each.name)
def test_it_is_refused_by_name_or_right(each: Hostile, tmp_path: Path) -> None:
    answer = each.done(tmp_path)
    assert answer.code in each.codes, answer
    assert re.search(each.says, answer.said, re.MULTILINE), answer.said
    assert "Traceback" not in answer.said
    assert "Exception ignored" not in answer.said
    if answer.code == 2 and not (tmp_path / "out").exists():
        assert {path.name for path in tmp_path.iterdir()} <= {"scene.toml", "frames.pvd"}


def test_no_name_is_taken_twice() -> None:
    """The names of cases are those of tests."""
    assert len({each.name for each in CASES}) == len(CASES) >= 45
