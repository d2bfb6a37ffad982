"""`./steadyhand deb`: the packages are installed in a bare Debian 12, used there, and removed."""

import re
import shutil
import subprocess

import pytest

from bare_debian import NEEDED, BareDebian, make_package
from places import ROOT

pytestmark = [pytest.mark.long, NEEDED]
LEFT = re.compile(r"/(proc|dev|tmp|var/log|var/cache|var/lib/dpkg)/|/etc/(ld\.so\.cache|group-?|gshadow-?|passwd-?|subgid-?|subuid-?)$|/var/lib/systemd/")


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, timeout=3600, **options)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
    return done.stdout


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """By name, the files of the packages."""
    return make_package("deb", tmp_path_factory.mktemp("deb"))


def field(package, name):
    return run("dpkg-deb", "--field", package, name).strip()


def files(root):
    return {str(path)[len(str(root)) :] for path in root.rglob("*") if not path.is_dir() and not LEFT.search(str(path)[len(str(root)) :])}


def test_names_versions_and_what_they_depend_on(packages):
    version = re.search(r"project\(steadyhand VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
    assert set(packages) == {"steadyhand", "libsteadyhand-dev"}
    assert {field(package, "Version") for package in packages.values()} == {version}
    needed = field(packages["steadyhand"], "Depends")
    assert "libc6 (>= 2.3" in needed and not re.search("libav|libmujoco|libegl|-dev", needed), needed
    assert f"steadyhand (= {version})" in field(packages["libsteadyhand-dev"], "Depends")


@pytest.mark.skipif(shutil.which("lintian") is None, reason="lintian is not installed")
def test_lintian_finds_no_error(packages):
    done = subprocess.run(["lintian", "--allow-root", "--fail-on", "error", *packages.values()], capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


def test_install_run_upgrade_remove(packages, tmp_path):
    depends = [re.sub(r"\s*[(|].*", "", each).strip() for each in field(packages["steadyhand"], "Depends").split(",")]
    debian = BareDebian(tmp_path / "debian", *depends)
    before = files(debian.folder)
    shutil.copy(packages["steadyhand"], debian.folder / "tmp/new.deb")
    older = tmp_path / "older"
    run("dpkg-deb", "--raw-extract", packages["steadyhand"], older)
    control = older / "DEBIAN/control"
    control.write_text(re.sub("(?m)^Version: .*", "Version: 0.2.9", control.read_text()))
    (older / "usr/share/steadyhand/gone.yaml").write_text("")
    run("dpkg-deb", "--build", older, debian.folder / "tmp/older.deb")
    for name in ("older", "new"):
        done = debian.run("dpkg", "--install", f"/tmp/{name}.deb")
        assert done.returncode == 0, done.stderr
    assert not (debian.folder / "usr/share/steadyhand/gone.yaml").exists()
    assert "steadyhand:" in (debian.folder / "etc/group").read_text()
    said = debian.run("steadyhand", "--version", user="daemon")
    assert said.returncode == 0 and "built in: ur ros2 mujoco cameras fit page" in said.stdout, said
    for level in ("", "glibc.cpu.hwcaps=-AVX512VL,-AVX2"):
        done = debian.run("env", f"GLIBC_TUNABLES={level}", "steadyhand", "demo", "--headless", "--no-recording", "--seconds", "2", user="daemon")
        assert done.returncode == 0 and "nothing spilled" in done.stdout, done
    done = debian.run("steadyhand", "demo", "--arm", "mujoco", "--headless", "--seconds", "1", user="daemon")
    assert done.returncode == 2 and "mujoco-core" in done.stderr
    assert debian.run("dpkg", "--purge", "steadyhand").returncode == 0
    assert files(debian.folder) - before == set() and "steadyhand:" not in (debian.folder / "etc/group").read_text()


def test_a_program_links_with_the_libraries(packages, tmp_path):
    for package in packages.values():
        run("dpkg-deb", "--extract", package, tmp_path / "extracted")
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.25)\nproject(user LANGUAGES CXX)\nfind_package(steadyhand 0.3 REQUIRED)\n"
        "add_executable(user user.cpp)\ntarget_link_libraries(user steadyhand::planning)\n"
    )
    (tmp_path / "user.cpp").write_text(re.search(r"```cpp\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)[1])
    run("cmake", "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={tmp_path}/extracted/usr")
    run("cmake", "--build", tmp_path / "build")
    environment = {"LD_LIBRARY_PATH": str(next((tmp_path / "extracted/usr/lib").glob("*/libsteadyhand_planning.so")).parent)}
    assert len(run(tmp_path / "build/user", env=environment).split()) == 500 * 6
