"""The energy that a machine takes, where it tells: Linux's counters of processor packages (RAPL, of Intel and AMD)."""

# pyright: strict

from pathlib import Path

POWERCAP = Path("/sys/class/powercap")


class EnergyMeter:
    """Joules since it was made, of all packages of the machine, whoever uses them."""

    def __init__(self, root: Path = POWERCAP):
        # "intel-rapl:0" is a package; "intel-rapl:0:0" a part of it, which is counted in it.
        self._packages = [each for each in sorted(root.glob("intel-rapl:*")) if each.name.count(":") == 1]
        self._before = self._read()

    @property
    def joules(self) -> float | None:
        """Energy since then [J], None where the machine does not tell. A counter that began anew once is understood."""
        now = self._read()
        if now is None or self._before is None:
            return None
        taken = 0
        for package, before, after in zip(self._packages, self._before, now, strict=True):
            around = _number(package / "max_energy_range_uj")
            if after < before and around is None:
                return None
            taken += after - before + (around or 0) * (after < before)
        return 1e-6 * taken

    def _read(self) -> list[int] | None:
        found = [_number(package / "energy_uj") for package in self._packages]
        told = [each for each in found if each is not None]
        return told if told and len(told) == len(found) else None


def _number(path: Path) -> int | None:
    try:
        return int(path.read_text())
    except (OSError, ValueError):  # absent, or for the superuser alone
        return None
