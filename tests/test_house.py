"""The house rules: what a reader of this repository may rely on wherever they look."""

import ast
import fnmatch
import re
import shlex
import tomllib
from collections import Counter, defaultdict
from functools import cache
from pathlib import Path

import pytest

from framerunner.cli import build_app
from scenarios.loader import list_scenarios

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
ROOMS = tuple(PROJECT["tool"]["importlinter"]["root_packages"])
FLOORS = tuple(  # the rooms inside framerunner/ that the others stand on, or beside
    f"framerunner.{name}" for name in ("errors", "files", "geometry", "monitor", "vehicle", "wire")
)
MODULES = sorted(path for room in ROOMS for path in (ROOT / room).rglob("*.py"))
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
LOCKS = sorted((ROOT / "locks").glob("*.txt"))
INSTALLED_LOCKS = [path for path in LOCKS if path.name != "mavproxy-without.txt"]
# Exceptions from the limits of 20, each with its reason. Take out what is no longer needed; the tests say so.
LARGE_FOLDERS = {}
LARGE_CLASSES = {
    "framerunner/flying/lockstep_drone.py LockstepDrone": "implements the port `Drone`",
    "offboard/mavsdk_drone.py MavsdkDrone": "implements the port `Drone`",
}
# Modules of the pages' messages: a class has the name of its message, or of a part of it.
MESSAGES = (
    "framerunner/editing/documents/document_messages.py",
    "framerunner/editing/editor_messages.py",
    "framerunner/monitor/competition/views.py",
    "framerunner/monitor/live_messages.py",
    "framerunner/monitor/manual_channel.py",
    "framerunner/wire/operator_messages.py",
)
# Literals that are only unpacked into calls, each with its reason.
UNPACKED = {}
HASHED = re.compile(r"\S+==[^\n]* \\\n( {4}--hash=sha256:[0-9a-f]{64}( \\)?\n)+( {4}#.*\n?)*\Z")


@cache
def parsed(path):
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def headings(path):
    """The names under which links find the headings of a document."""
    found = re.findall(r"^#+ (.+)$", path.read_text(encoding="utf-8"), re.MULTILINE)
    plain = (re.sub(r"\[(.*?)\]\(.*?\)", r"\1", each).lower() for each in found)
    return {re.sub(r"[^\w\- ]", "", each).replace(" ", "-") for each in plain}


def name_of(path):
    return str(path.relative_to(ROOT))


def commands_in(text, program):
    """Indented lines that start with a program, without the program."""
    lines = re.findall(rf"^(?: {{4,}}|\t)(?:\.venv/bin/)?{program} (.+)$", text, re.MULTILINE)
    return [shlex.split(line.partition(">")[0], comments=True) for line in lines]


def documented_commands():
    sources = [*DOCUMENTS, ROOT / "Makefile", *(ROOT / "framerunner" / "commands").glob("*.py")]
    found = {}
    for path in sources:
        text = path.read_text(encoding="utf-8").replace("$(BIN)/", "")
        for words in commands_in(text, "framerunner"):
            found.setdefault(" ".join(words), words)
    return found


COMMANDS = documented_commands()
program = cache(build_app)


def test_the_readme_shows_the_four_uses_in_order():
    shown = [
        " ".join(words)
        for words in commands_in((ROOT / "README.md").read_text(encoding="utf-8"), "framerunner")
    ]
    wanted = ["sim", "sim --scenario test-case-1", "fly test-case-1", "mission show explorer"]
    places = [shown.index(command) for command in wanted]
    assert places == sorted(places)
    assert any(command.startswith("fly test-case-1 --drone serial://") for command in shown[places[-1] :])


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS.keys())
def test_documented_commands_are_understood(words, tmp_path, monkeypatch):
    (tmp_path / "flight.yaml").write_text("max-speed: 0.5\n", encoding="utf-8")  # for --settings
    monkeypatch.chdir(tmp_path)
    program().parse_args(words, print_error=False, exit_on_error=False)


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_documented_make_targets_exist(document):
    targets = set(
        re.findall(r"^([a-z0-9-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    )
    used = set(
        re.findall(r"(?:^ {4}|`)make ([a-z][a-z0-9-]*)", document.read_text(encoding="utf-8"), re.MULTILINE)
    )
    assert used <= targets


@pytest.mark.parametrize("document", DOCUMENTS, ids=name_of)
def test_links_between_documents_lead_somewhere(document):
    links = re.findall(r"\]\(([^)#\s]*)#?([^)\s]*)\)", document.read_text(encoding="utf-8"))
    broken = []
    for path, heading in links:
        target = document.parent / path if path else document
        if "://" in path or (target.exists() and not (heading and target.suffix == ".md")):
            continue
        if not target.exists() or heading not in headings(target):
            broken.append(f"{path}#{heading}")
    assert broken == []


def test_the_changelog_knows_the_version():
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert f"\n## [{PROJECT['project']['version']}]" in changelog


def test_every_yaml_file_is_shipped():
    patterns = PROJECT["tool"]["setuptools"]["package-data"]
    forgotten = [
        name_of(path)
        for room in ROOMS
        for path in (ROOT / room).rglob("*.yaml")
        if not any(
            fnmatch.fnmatch(str(path.relative_to(ROOT / room)), each) for each in patterns.get(room, [])
        )
    ]
    assert forgotten == []


@pytest.mark.parametrize("room", ROOMS)
def test_every_room_is_a_typed_package_that_is_shipped_and_bound_by_the_rules(room):
    assert (ROOT / room / "py.typed").exists()
    assert all((path.parent / "__init__.py").exists() for path in MODULES if path.is_relative_to(ROOT / room))
    tools = PROJECT["tool"]
    assert f"{room}*" in tools["setuptools"]["packages"]["find"]["include"]
    assert room in tools["mypy"]["files"]
    assert room in tools["ruff"]["lint"]["isort"]["known-first-party"]


def test_no_package_is_outside_the_rooms():
    packages = {path.parent.name for path in ROOT.glob("*/__init__.py")}
    assert packages == set(ROOMS)


def statements_in(node):
    """How many statements a module or function has, nested ones too."""
    return sum(isinstance(each, ast.stmt) for within in node.body for each in ast.walk(within))


def test_modules_have_at_most_400_statements():
    counts = {name_of(path): statements_in(parsed(path)) for path in MODULES}
    assert {name: count for name, count in counts.items() if count > 400} == {}


def test_make_test_runs_every_real_time_test():
    """`make test-realtime` names two folders, so that its workers need not read all tests."""
    marked = {
        path.relative_to(ROOT / "tests").parts[0]
        for path in (ROOT / "tests").rglob("test_*.py")
        if "pytest.mark." + "realtime" in path.read_text(encoding="utf-8")
    }
    assert marked == {"realtime", "offboard"}


def test_folders_have_at_most_20_modules():
    modules = Counter(name_of(path.parent) for path in MODULES if path.name != "__init__.py")
    assert {name for name, count in modules.items() if count > 20} == set(LARGE_FOLDERS)


def test_classes_have_at_most_20_methods():
    large = set()
    for path in MODULES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                functions = (ast.FunctionDef, ast.AsyncFunctionDef)
                if len({each.name for each in node.body if isinstance(each, functions)}) > 20:
                    large.add(f"{name_of(path)} {node.name}")
    assert large == set(LARGE_CLASSES)


def functions_of(path):
    return [
        each for each in ast.walk(parsed(path)) if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef)
    ]


def test_functions_have_at_most_45_statements():
    counts = {
        f"{name_of(path)}:{function.lineno} {function.name}": statements_in(function)
        for path in MODULES
        for function in functions_of(path)
    }
    assert {name: count for name, count in counts.items() if count > 45} == {}


def bindings(node):
    """Names with what a statement or `:=` binds them to; `a, b = x, y` binds two."""
    targets = getattr(node, "targets", None) or [getattr(node, "target", None)]
    for target in targets:
        value = getattr(node, "value", None)
        several = isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple)
        pairs = zip(target.elts, value.elts, strict=False) if several else [(target, value)]
        yield from ((name.id, each) for name, each in pairs if isinstance(name, ast.Name))


def unpacked_in(call):
    return [each.value for each in call.args if isinstance(each, ast.Starred)]


def tuples_to_unpack(function):
    """Names that are bound to nothing but literals, and used for nothing but `f(*name)`."""
    literals, bound, used, unpacked = Counter(), Counter(), Counter(), Counter()
    for node in ast.walk(function):
        literals.update(name for name, value in bindings(node) if isinstance(value, ast.Tuple | ast.List))
        if isinstance(node, ast.Name):
            (used if isinstance(node.ctx, ast.Load) else bound)[node.id] += 1
        if isinstance(node, ast.arg):
            bound[node.arg] += 1
        if isinstance(node, ast.Call):
            unpacked.update(each.id for each in unpacked_in(node) if isinstance(each, ast.Name))
    return {name for name in literals if literals[name] == bound[name] and 0 < used[name] == unpacked[name]}


def test_arguments_are_not_packed_to_be_unpacked():
    """Keyword arguments or a data class say what the values are; `f(*(a, b))` only dodges a limit."""
    literals = {
        f"{name_of(path)} {ast.unparse(call.func)}"
        for path in MODULES
        for call in ast.walk(parsed(path))
        if isinstance(call, ast.Call)
        and any(isinstance(each, ast.Tuple | ast.List) for each in unpacked_in(call))
    }
    names = {
        f"{name_of(path)} {name}"
        for path in MODULES
        for function in functions_of(path)
        for name in tuples_to_unpack(function)
    }
    assert literals | names == set(UNPACKED)


@pytest.mark.parametrize(
    ("body", "found"),
    [
        ("x = (1, 2); g(*x)", {"x"}),
        ("x: tuple = (1, 2); g(0, *x); h(*x)", {"x"}),
        ("x, y = (1, 2), 3; g(*x, y)", {"x"}),
        ("x = (1, 2); g(*x); return x", set()),
        ("x = (1, 2) if z else (3, 4); g(*x)", set()),
        ("x = (1, 2)\n    if z: x = h()\n    g(*x)", set()),
        ("z = (1, 2); g(*z)", set()),
        ("g(*[0] * 3)", set()),
    ],
)
def test_tuples_that_are_only_unpacked_are_found(body, found):
    assert tuples_to_unpack(ast.parse(f"def f(z):\n    {body}")) == found


def module_name(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


def imports(node, modules):
    """The modules that are imported below a node when the code runs, late imports too."""
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return {name for each in node.orelse for name in imports(each, modules)}
    if isinstance(node, ast.Import):
        return modules & {alias.name for alias in node.names}
    if isinstance(node, ast.ImportFrom):
        parts = {f"{node.module}.{alias.name}" for alias in node.names}
        return modules & (parts if parts <= modules else {*parts, node.module})
    return {name for child in ast.iter_child_nodes(node) for name in imports(child, modules)}


def test_no_modules_import_each_other_in_a_circle():
    names = {module_name(path) for path in MODULES}
    left = {module_name(path): imports(parsed(path), names) for path in MODULES}
    # Whoever imports nothing that is left is in no circle, nor is whoever nothing that is left imports.
    while True:
        needed = set().union(*left.values())
        circles = {name: sorted(left[name] & left.keys()) for name in left.keys() & needed}
        circles = {name: needs for name, needs in circles.items() if needs}
        if circles.keys() == left.keys():
            break
        left = {name: set(needs) for name, needs in circles.items()}
    assert circles == {}


def names_bound(path):
    """Names that a module binds at its top level, in any branch."""
    found, waiting = set(), [*parsed(path).body]
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found.update(alias.asname or alias.name.partition(".")[0] for alias in node.names)
        else:
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                found.add(node.id)
            waiting += ast.iter_child_nodes(node)
    return found


def test_what_is_imported_exists():
    """Of our own modules, late imports and those of programs that no test runs too."""
    files = [path for folder in (*ROOMS, "benchmarks", "tests") for path in (ROOT / folder).rglob("*.py")]
    bound = {module_name(path): names_bound(path) for path in files}
    modules = {*bound, *(name.rpartition(".")[0] for name in bound)}
    missing = [
        f"{name_of(path)}:{node.lineno} {node.module}.{alias.name}"
        for path in files
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.ImportFrom)
        and node.module.partition(".")[0] in {*ROOMS, "benchmarks", "tests"}
        for alias in node.names
        if alias.name not in bound.get(node.module, set()) and f"{node.module}.{alias.name}" not in modules
    ]
    assert missing == []


def reads_text(call):
    """Whether a call reads a file as text: `path.read_text()`, or `open` with an encoding."""
    function = call.func.attr if isinstance(call.func, ast.Attribute) else ast.unparse(call.func)
    if function != "open":
        return function == "read_text" and isinstance(call.func, ast.Attribute)
    modes = {each.value for each in call.args if isinstance(each, ast.Constant)} & {
        "w",
        "x",
        "a",
        "wb",
        "xb",
        "ab",
    }
    return any(each.arg == "encoding" for each in call.keywords) and not modes


def test_texts_are_read_by_the_one_reader():
    """It knows byte order marks, line ends and UTF-16; /proc's files have none of these."""
    found = {
        f"{name_of(path)}: {ast.unparse(node)}"
        for path in MODULES
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Call) and reads_text(node)
    }
    assert {each for each in found if "'/proc/" not in each and "os.devnull" not in each} == set()


def test_yaml_is_read_by_the_one_reader():
    """It has limits for strangers' files; others only write YAML."""
    reader = ROOT / "framerunner" / "files" / "yaml_text.py"
    calls = re.compile(
        r"\byaml\.(?!safe_dump\b|YAMLError\b|MarkedYAMLError\b|Mark\b)\w+\(|^from yaml", re.MULTILINE
    )
    others = [path for path in MODULES if path != reader]
    assert [name_of(each) for each in others if calls.search(each.read_text(encoding="utf-8"))] == []


def test_errors_for_people_are_user_errors():
    """The command line prints a UserError; any other error ends in a traceback."""
    strays = [
        f"{name_of(path)}:{node.lineno} {node.name}"
        for path in MODULES
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.ClassDef) and "for people" in (ast.get_docstring(node) or "")
        if {ast.unparse(base) for base in node.bases} & {"Exception", "OSError", "RuntimeError", "ValueError"}
    ]
    assert strays == []


def room_of(module):
    """The room of a module, by its dotted name."""
    within = ".".join(module.split(".")[:2])
    return within if within in FLOORS else module.partition(".")[0]


def test_no_room_has_two_classes_of_one_name():
    found = defaultdict(list)
    for path in MODULES:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                found[room_of(module_name(path)), node.name].append(name_of(path))
    assert {key: places for key, places in found.items() if len(places) > 1} == {}


def test_no_two_public_classes_have_one_name():
    found = defaultdict(list)
    for path in MODULES:
        for node in parsed(path).body:
            if (
                isinstance(node, ast.ClassDef)
                and not node.name.startswith("_")
                and name_of(path) not in MESSAGES
            ):
                found[node.name].append(name_of(path))
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_modules_of_messages_are_named_for_what_they_hold():
    assert [name_of(path) for path in MODULES if path.name == "messages.py"] == []


def test_nothing_is_decided_by_the_name_of_a_scenario():
    names = set(list_scenarios()) - {"empty"}
    decisions = [
        f"{name_of(path)}:{constant.lineno} {constant.value}"
        for path in MODULES
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.Compare | ast.Match | ast.Dict)
        for constant in ast.walk(node)
        if isinstance(constant, ast.Constant) and constant.value in names
    ]
    assert decisions == []


@pytest.mark.parametrize("path", LOCKS, ids=name_of)
def test_locked_versions_name_no_place_to_get_them_from(path):
    text = path.read_text(encoding="utf-8")
    assert "://" not in text
    assert not re.search(r"^\s*--(?!hash=)", text, re.MULTILINE)


@pytest.mark.parametrize("path", INSTALLED_LOCKS, ids=name_of)
def test_everything_that_is_locked_has_hashes(path):
    entries = re.split(r"^(?=[A-Za-z0-9])", path.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    assert entries
    assert [entry.split()[0] for entry in entries if not HASHED.match(entry)] == []


def locked(name):
    """Versions by package; more than one where they depend on Python's version."""
    text = (ROOT / "locks" / f"{name}.txt").read_text(encoding="utf-8")
    found = defaultdict(set)
    for package, version in re.findall(r"^([A-Za-z0-9._-]+)==(.*?) \\$", text, re.MULTILINE):
        found[package].add(version)
    return found


def needed(*extras):
    """What pyproject.toml asks for, as the files in locks/ name it."""
    project = PROJECT["project"]
    lines = [
        *project["dependencies"],
        *(each for e in extras for each in project["optional-dependencies"][e]),
    ]
    names = {re.match(r"[A-Za-z0-9._-]+", line).group().replace("_", "-").lower() for line in lines}
    return names - {"framerunner"}


@pytest.mark.parametrize(
    ("name", "extras"),
    [
        ("small", []),
        ("framerunner", ["monitor", "recording", "video"]),
        ("extras", ["monitor", "recording", "video", "dask", "gym", "postgresql"]),
        ("dev", ["monitor", "recording", "video", "dask", "docs", "gym", "dev"]),
    ],
)
def test_everything_that_is_needed_is_locked_and_no_lock_contradicts_another(name, extras):
    own, dev = locked(name), locked("dev")
    assert needed(*extras) | {"setuptools"} <= set(own)
    assert {package for package in own if package in dev and own[package] != dev[package]} == set()


def test_nothing_is_left_half_done():
    marks = re.compile(r"\b(?:TO" + r"DO|FIX" + r"ME|X" + r"XX|HA" + r"CK)\b|^<{7} |^>{7} ", re.MULTILINE)
    unfinished = [
        name_of(path) for path in (*MODULES, *DOCUMENTS) if marks.search(path.read_text(encoding="utf-8"))
    ]
    assert unfinished == []
