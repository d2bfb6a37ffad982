"""The closing lines of `./steadyhand test`: nothing that failed or was skipped goes unsaid."""

import subprocess
import sys

from places import ROOT

CTEST = """<testsuite>
<testcase name="core" classname="core" status="run"/>
<testcase name="robot" classname="robot" status="fail"><failure message="SEGFAULT"/></testcase>
<testcase name="example_01" classname="example_01" status="run"/>
<testcase name="x86-64-v4" classname="x86-64-v4" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/>
<system-out>this processor has no AVX-512</system-out></testcase>
</testsuite>"""
CORE = """<testsuites><testsuite>
<testcase name="One" classname="A" status="run"/><testcase name="Two" classname="A" status="run"/>
<testcase name="Three" classname="A" status="run"><skipped message="no route"/></testcase>
</testsuite></testsuites>"""
ROBOT = """<testsuites><testsuite><testcase name="One" classname="B" status="run"/></testsuite></testsuites>"""
PYTEST = """<testsuites><testsuite><testcase classname="t" name="a"/><testcase classname="t" name="b"><skipped message="no browser"/>
</testcase><testcase classname="t" name="c"><error message="x"/></testcase></testsuite></testsuites>"""


def summary(folder):
    done = subprocess.run([sys.executable, ROOT / "tests/summary.py", folder], capture_output=True, text=True)
    return done.returncode, done.stdout.splitlines()


def write(folder, **files):
    for name, text in files.items():
        path = folder / "pytest.xml" if name == "pytest" else folder / "asan" / f"{name}.xml"
        path.parent.mkdir(exist_ok=True)
        path.write_text(text)


def test_counts_cases_and_names_what_failed_or_was_skipped(tmp_path):
    write(tmp_path, ctest=CTEST, test_core=CORE, test_robot=ROBOT, pytest=PYTEST)
    code, lines = summary(tmp_path)
    assert code == 1
    assert lines[-1] == "5 passed, 2 failed, 3 skipped"
    assert "ctest (asan): 4 passed, 1 failed, 2 skipped" in lines
    assert "failed: ctest (asan) robot" in lines, "died, though each of its cases that ended had passed"
    assert "skipped: ctest (asan) x86-64-v4: this processor has no AVX-512" in lines
    assert "skipped: ctest (asan) A.Three: no route" in lines
    assert "skipped: pytest t.b: no browser" in lines
    assert "failed: pytest t.c" in lines


def test_a_run_that_left_no_results_has_failed(tmp_path):
    write(tmp_path, pytest=PYTEST.replace("<error message=\"x\"/>", ""))
    (tmp_path / "asan").mkdir()
    code, lines = summary(tmp_path)
    assert (code, lines[-1]) == (1, "2 passed, 1 failed, 1 skipped")
    assert "failed: ctest (asan) ended without its results" in lines


def test_a_program_that_was_not_built_has_failed(tmp_path):
    write(tmp_path, pytest=PYTEST, ctest=CTEST.replace("SKIP_RETURN_CODE=77", "Unable to find executable"))
    assert "failed: ctest (asan) x86-64-v4: Unable to find executable" in summary(tmp_path)[1]


def test_exit_code_is_zero_only_if_something_passed_and_nothing_failed(tmp_path):
    write(tmp_path, pytest='<testsuites><testsuite><testcase name="a"><skipped message="b"/></testcase></testsuite></testsuites>')
    assert summary(tmp_path)[0] == 1, "nothing passed"
    write(tmp_path, pytest=PYTEST.replace("<error message=\"x\"/>", ""), ctest=CTEST.replace('status="fail"><failure message="SEGFAULT"/>', 'status="run">'), test_core=CORE)
    assert summary(tmp_path)[0] == 0
