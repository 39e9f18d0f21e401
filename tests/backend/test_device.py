"""Memory that is free: the least of what the machine, the limits of the process and its control groups leave."""

import resource

import pytest

from wsph.backend import device

PAGE = resource.getpagesize()
FILES = {
    "/proc/meminfo": "MemTotal:       2000 kB\nMemAvailable:   1000 kB\n",
    "/proc/self/statm": "100 50 20 5 0 60 0",
}


def files(monkeypatch: pytest.MonkeyPatch, **more: str) -> None:
    """The files of a system, and limits that leave all."""
    there = FILES | {"/" + path.replace("__", "/"): text for path, text in more.items()}
    monkeypatch.setattr(device, "_text", lambda path: there.get(path, ""))
    monkeypatch.setattr(resource, "getrlimit", lambda which: (resource.RLIM_INFINITY, resource.RLIM_INFINITY))


def test_the_cpu_has_what_the_machine_has(monkeypatch: pytest.MonkeyPatch) -> None:
    files(monkeypatch)
    assert device.free_memory("cpu") == (1024000.0, 1024000.0)


def test_limits_of_the_process_count_what_it_has_already(monkeypatch: pytest.MonkeyPatch) -> None:
    files(monkeypatch)
    limits = {resource.RLIMIT_AS: 150 * PAGE, resource.RLIMIT_DATA: resource.RLIM_INFINITY}
    monkeypatch.setattr(resource, "getrlimit", lambda which: (limits[which], limits[which]))
    assert device.free_memory("cpu")[1] == 50 * PAGE
    limits[resource.RLIMIT_DATA] = 70 * PAGE
    assert device.free_memory("cpu")[1] == 10 * PAGE
    limits[resource.RLIMIT_DATA] = 50 * PAGE
    assert device.free_memory("cpu")[1] == 0.0


GROUPS = {
    "of its own": ("0::/a/b\n", "a__b__", "max", "current"),
    "above it": ("0::/a/b\n", "a__", "max", "current"),
    "in a container": ("0::/elsewhere\n", "", "max", "current"),
    "of the first version": ("5:cpu:/\n4:memory:/a\n", "memory__a__", "limit_in_bytes", "usage_in_bytes"),
}


@pytest.mark.parametrize("name", list(GROUPS))
def test_control_groups_leave_what_they_do_not_use_and_their_caches(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    line, at, most, used = GROUPS[name]
    place = f"sys__fs__cgroup__{at}memory."
    more = {place + most: "900000\n", place + used: "800000\n", place + "stat": "anon 5\ninactive_file 50000\n"}
    files(monkeypatch, proc__self__cgroup=line, **more)
    assert device.free_memory("cpu")[1] == 150000.0


def test_a_group_without_a_bound_leaves_all(monkeypatch: pytest.MonkeyPatch) -> None:
    files(monkeypatch, proc__self__cgroup="0::/\n", **{"sys__fs__cgroup__memory.max": "max\n"})
    assert device.free_memory("cpu")[1] == 1024000.0


def test_where_the_system_says_nothing_nothing_is_known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "_text", lambda path: "")
    assert device.free_memory("cpu") == (None, None)


def test_processes_of_a_machine_take_a_gpu_each(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(device, "start_warp", lambda: None)
    monkeypatch.setattr(device.wp, "get_devices", lambda: ["cpu", "cuda:0", "cuda:1"])
    monkeypatch.setattr(device.wp, "is_cuda_available", lambda: True)
    for name in ("auto", "cuda"):
        assert [device.pick_device(name, place) for place in range(3)] == ["cuda:0", "cuda:1", "cuda:0"]
    assert [device.pick_device(name, 1) for name in ("cuda:0", "cpu")] == ["cuda:0", "cpu"]
