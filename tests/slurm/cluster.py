"""A cluster of SLURM on this machine, for as long as a block of code: a head and two nodes, each with a network, a name, a
/dev/shm and processes of its own, joined by a virtual network; what they see of the disk is the same. Needs Linux, root and
Debian's slurm-wlm, munge, libpmix-dev and iproute2; leaves neither processes nor networks.

    python -m tests.slurm.cluster COMMAND ...     # runs it at the head, as `srun -N2 hostname`
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.ranks.launch import environment

PROGRAMS = ("sbatch", "srun", "scancel", "slurmctld", "slurmd", "munged", "unshare", "nsenter", "ip")
READY = 30.0
"""Time in which all nodes have to be there [s]."""

NAMESPACES = ("--net", "--mount", "--uts", "--pid")
UNSHARE = ["unshare", *NAMESPACES, "--fork", "--mount-proc", "--kill-child"]

CONF = """\
ClusterName=wsph
SlurmctldHost=head
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={at}/munge.socket
StateSaveLocation={at}/state
SlurmdSpoolDir={at}/spool-%n
TmpFS={at}/tmp-%n
SlurmctldPidFile={at}/slurmctld.pid
SlurmdPidFile={at}/slurmd-%n.pid
SlurmctldLogFile={at}/slurmctld.log
SlurmdLogFile={at}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
ReturnToService=2
MpiDefault=none
PropagateResourceLimits=NONE
KillWait=5
NodeName=n[1-2] CPUs=4 RealMemory=4000 State=UNKNOWN
PartitionName=all Nodes=n[1-2] Default=YES MaxTime=INFINITE State=UP
"""

# Every node has a link of its own to the switch of the head, which is put into its network from there.
HEAD = """\
set -e
hostname head
mount --bind {at}/hosts /etc/hosts
ip link set lo up
ip link add eth0 type bridge
ip addr add 10.77.0.1/24 dev eth0
ip link set eth0 up
munged --force --key-file={at}/munge.key --socket={at}/munge.socket --pid-file={at}/munged.pid \
  --log-file={at}/munged.log --seed-file={at}/munge.seed
for k in 1 2; do
  {unshare} bash {at}/node.sh $k > {at}/n$k.out 2>&1 &
  until node=$(cat /proc/$!/task/$!/children) && [ -n "$node" ]; do sleep 0.02; done
  ip link add v$k type veth peer name eth0 netns $node
  ip link set v$k master eth0 up
done
exec slurmctld -D > {at}/slurmctld.out 2>&1
"""

NODE = """\
set -e
hostname n$1
mount -t tmpfs shm /dev/shm
until ip link show eth0 > /dev/null 2>&1; do sleep 0.02; done
ip link set lo up
ip addr add 10.77.0.1$1/24 dev eth0
ip link set eth0 up
exec slurmd -D -N n$1
"""


def lacking() -> str:
    """What this machine lacks for it, in words; empty where it lacks nothing."""
    if missing := [each for each in PROGRAMS if shutil.which(each) is None]:
        return f"needs SLURM: there is no {', '.join(missing)}"
    if os.geteuid() != 0:
        return "needs root, who makes networks"
    script = "ip link add eth0 type bridge && ip link add v1 type veth peer name v2"
    made = subprocess.run([*UNSHARE, "sh", "-c", script], capture_output=True, text=True, timeout=20.0)
    return f"needs networks of its own: {made.stderr.strip()}" if made.returncode else ""


class Cluster:
    """The cluster; `folder` is one that its nodes see."""

    def __init__(self) -> None:
        self.folder = Path(tempfile.mkdtemp(prefix="slurm-", dir="/tmp"))  # the name of a socket has to be short
        self._head: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> "Cluster":
        at = self.folder
        for name in ("state", "spool-n1", "spool-n2", "tmp-n1", "tmp-n2"):
            (at / name).mkdir()
        (at / "slurm.conf").write_text(CONF.format(at=at))
        names = (("127.0.0.1", "localhost"), ("10.77.0.1", "head"), ("10.77.0.11", "n1"), ("10.77.0.12", "n2"))
        (at / "hosts").write_text("".join(f"{place} {name}\n" for place, name in names))
        (at / "munge.key").write_bytes(os.urandom(32))
        (at / "munge.key").chmod(0o400)
        (at / "head.sh").write_text(HEAD.format(at=at, unshare=" ".join(UNSHARE)))
        (at / "node.sh").write_text(NODE)
        with (at / "head.out").open("wb") as said:
            self._head = subprocess.Popen(
                [*UNSHARE, "bash", str(at / "head.sh")],
                stdin=subprocess.DEVNULL,
                stdout=said,
                stderr=said,
                env=self._environment(),
            )
        end = time.monotonic() + READY
        while "2 idle" not in self._states():
            if self._head.poll() is not None or time.monotonic() > end:
                said = (at / "head.out").read_text() + self._states()
                self.__exit__()
                raise RuntimeError(f"SLURM does not start: {said}")
            time.sleep(0.2)
        return self

    def __exit__(self, *_: object) -> None:
        if self._head is not None:
            self._head.kill()  # and with it, as the first process of their namespace, all that are in it
            self._head.wait(20.0)
        shutil.rmtree(self.folder, ignore_errors=True)

    def _environment(self) -> dict[str, str]:
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
        started = {
            name: text for name, text in environment().items() if not name.startswith(("SLURM_", "OMPI_COMM", "PMI"))
        }
        # All nodes have the same cores: of processes that wait for others none may keep these from them.
        shared = {"OMPI_MCA_mpi_yield_when_idle": "1"}
        return {**started, **shared, "SLURM_CONF": str(self.folder / "slurm.conf"), "PATH": path}

    def _states(self) -> str:
        try:
            done = self.run("sinfo", "-h", "-o", "%D %t", seconds=5.0)
        except (subprocess.TimeoutExpired, RuntimeError):
            return ""
        return done.stdout

    def at_head(self, *command: str) -> list[str]:
        """The command line that runs a command at the head, in the cluster's folder. Raises RuntimeError without it."""
        head = self._head.pid if self._head is not None else 0
        children = Path(f"/proc/{head}/task/{head}/children")
        inner = children.read_text().split() if children.exists() else []
        if not inner:
            raise RuntimeError("there is no head")
        return ["nsenter", "-t", inner[0], *NAMESPACES, f"--wd={self.folder}", *command]

    def start(self, *command: str) -> subprocess.Popen[str]:
        """Start a command at the head."""
        return subprocess.Popen(
            self.at_head(*command),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            env=self._environment(),
        )

    def run(self, *command: str, seconds: float = 100.0) -> subprocess.CompletedProcess[str]:
        """What a command at the head says. Raises TimeoutExpired."""
        process = self.start(*command)
        try:
            said = process.communicate(timeout=seconds)[0]
        except subprocess.TimeoutExpired:
            process.kill()
            raise
        return subprocess.CompletedProcess(command, process.returncode, said)

    def processes(self, variable: str, of: str = "") -> list[int]:
        """The processes, by their numbers outside, whose environment has a variable, as "SLURM_PROCID=1", and whose command
        line has a word."""
        found: list[int] = []
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                variables, line = (entry / "environ").read_bytes().split(b"\0"), (entry / "cmdline").read_bytes()
            except OSError:
                continue
            own = f"SLURM_CONF={self.folder}/slurm.conf".encode() in variables
            if own and variable.encode() in variables and of.encode() in line:
                found.append(int(entry.name))
        return found

    def end_node(self, name: str) -> None:
        """Kill all of a node at once, as where its power fails."""
        for entry in Path("/proc").glob("[0-9]*"):
            try:
                line = (entry / "cmdline").read_bytes().split(b"\0")
            except OSError:
                continue
            if line[:1] == [b"unshare"] and f"{self.folder}/node.sh".encode() in line and name[1:].encode() in line:
                os.kill(int(entry.name), 9)


if __name__ == "__main__":
    if why := lacking():
        sys.exit(why)
    with Cluster() as cluster:
        done = cluster.run(*sys.argv[1:], seconds=3600.0)
        print(done.stdout, end="")
        sys.exit(done.returncode)
