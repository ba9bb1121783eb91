"""The rules of the house that a reader of one file cannot see, checked by walking every module's syntax tree."""

from __future__ import annotations

import ast
import importlib.metadata
import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
ROOMS = ("tracker", "bridge", "tools", "config")

# config is data: anyone may look a file up in it.
MAY_IMPORT = {
    "tracker": {"tracker"},
    "bridge": {"tracker", "bridge", "config"},
    "tools": {"tracker", "bridge", "tools", "config"},
    "config": {"config"},
}
STAGES = ("image.detect", "start.associate", "start.triangulate", "start.pose3", "filter.ekf")
# A pixel's way: an image gives sightings, sightings give a first pose, the filter carries it on; none looks back up.
INNER_ROOMS = {
    "maths": {"maths"},
    "filter": {"maths", "filter"},
    "image": {"maths", "filter", "image"},
    "start": {"maths", "filter", "image", "start"},
    "health": {"maths", "filter", "health"},
}
OUTSIDE_THE_CORE = {
    "pymavlink", "serial", "socket", "socketserver", "ssl", "asyncio", "selectors", "pydantic", "typer", "rich", "mcap",
}  # fmt: skip
DEVICES = {"socket", "socketserver", "serial", "asyncio", "http", "urllib"}
IN_THE_BOX = {*sys.stdlib_module_names, *ROOMS, "_typeshed"}  # the last comes with the type checker
CLOCKS = ("time", "monotonic", "perf_counter", "process_time", "clock_gettime")


@dataclass(frozen=True)
class Module:
    """One source file: its dotted name, its path in the project and its syntax tree."""

    name: str
    path: str
    tree: ast.Module

    def imports(self) -> set[str]:
        """Return the dotted names it imports, `package.module` for `from package import module` too."""
        return set(_imports(self.tree))


def _imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield "." * node.level + (node.module or "")
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _modules(*rooms: str) -> list[Module]:
    files = sorted(path for room in rooms for path in (ROOT / room).rglob("*.py"))
    return [
        Module(
            name=".".join(path.relative_to(ROOT).with_suffix("").parts),
            path=path.relative_to(ROOT).as_posix(),
            tree=ast.parse(path.read_text(encoding="utf-8"), str(path)),
        )
        for path in files
    ]


def _top(dotted: str) -> str:
    return dotted.partition(".")[0]


@pytest.mark.parametrize("room", ROOMS)
def test_imports_run_one_way_from_tests_to_tools_to_bridge_to_tracker(room: str) -> None:
    strangers = {*ROOMS, "tests"} - MAY_IMPORT[room]
    wrong = {
        f"{module.path} imports {name}"
        for module in _modules(room)
        for name in module.imports()
        if _top(name) in strangers
    }
    assert not wrong


def test_imports_are_absolute_so_that_the_other_rules_see_them() -> None:
    assert not {module.path for module in _modules(*ROOMS) for name in module.imports() if name.startswith(".")}


def test_the_tracker_knows_no_link_no_message_no_config_and_no_screen() -> None:
    wrong = {
        f"{module.path} imports {name}"
        for module in _modules("tracker")
        for name in module.imports()
        if _top(name) in OUTSIDE_THE_CORE
    }
    assert not wrong


def test_only_one_module_imports_pymavlink() -> None:
    users = {module.path for module in _modules(*ROOMS) if "pymavlink" in map(_top, module.imports())}
    assert users == {"bridge/dialect.py"}


def test_only_the_links_and_the_far_ends_of_simulations_open_sockets_and_ports() -> None:
    users = {module.path for module in _modules(*ROOMS) if DEVICES & set(map(_top, module.imports()))}
    far_ends = ("tools/simulate/autopilot/port.py", "tools/sitl/")
    strangers = {
        path for path in users if not path.startswith(("bridge/links/", "bridge/telemetry/post.py", *far_ends))
    }
    assert users
    assert not strangers


def test_only_the_command_line_takes_the_real_clock() -> None:
    takers = {module.path for module in _modules(*ROOMS) if any(_clock_reads(module.tree))}
    assert takers == {"tools/cli.py"}


def test_stages_of_the_tracker_never_import_each_other() -> None:
    stages = {f"tracker.{stage}" for stage in STAGES}
    modules = [module for module in _modules("tracker") if module.name in stages]
    assert {module.name for module in modules} == stages
    assert not {f"{module.name} imports {name}" for module in modules for name in module.imports() & stages}


@pytest.mark.parametrize("room", INNER_ROOMS)
def test_the_trackers_inner_rooms_import_one_way(room: str) -> None:
    modules = _modules(f"tracker/{room}")
    barred = {f"tracker.{other}" for other in INNER_ROOMS if other not in INNER_ROOMS[room]} | {"tracker.pipeline"}
    assert modules
    assert not {
        f"{module.name} imports {name}"
        for module in modules
        for name in module.imports()
        if any(name == bar or name.startswith(f"{bar}.") for bar in barred)
    }


def test_every_package_imported_is_a_declared_dependency_and_the_other_way_round() -> None:
    """Otherwise a fresh environment lacks it, however well the developer's own one works."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = {_canonical(re.split(r"[^\w.-]", line)[0]) for line in project["dependencies"]}
    providers = importlib.metadata.packages_distributions()
    undeclared, used = {}, set()
    for name in {_top(name) for module in _modules(*ROOMS) for name in module.imports()} - IN_THE_BOX:
        by = {_canonical(distribution) for distribution in providers.get(name, [])}
        used |= by & declared
        if not by & declared:
            undeclared[name] = by
    assert undeclared == {}
    assert declared - used == set()


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import time\nt = time.monotonic_ns()", True),
        ("import time as t\nt.perf_counter()", True),
        ("from time import time_ns", True),
        ("import datetime\ndatetime.datetime.now()", True),
        ("import time\ntime.sleep(1)", False),
        ("t_ns = clock.now_ns()", False),
        ("def f(time): return time.p50", False),
    ],
)
def test_the_clock_rule_sees_every_way_to_read_one(text: str, found: bool) -> None:
    assert any(_clock_reads(ast.parse(text))) is found


def _canonical(distribution: str) -> str:
    return re.sub(r"[-_.]+", "-", distribution).lower()


def _clock_reads(tree: ast.Module) -> Iterator[str]:
    """Find uses of `time.monotonic*`, `perf_counter*`, `time.time*` and `datetime.now`, called or handed on."""
    aliases = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.Import)
        for alias in node.names
        if alias.name == "time"
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module == "time":
            yield from (alias.name for alias in node.names if alias.name.startswith(CLOCKS))
        elif isinstance(node, ast.Attribute):
            of_time = isinstance(node.value, ast.Name) and node.value.id in aliases
            if (of_time and node.attr.startswith(CLOCKS)) or node.attr in ("utcnow", "today"):
                yield node.attr
            if node.attr == "now" and "datetime" in ast.unparse(node.value):
                yield node.attr
