#!/usr/bin/env python3
"""test_command_test.py ROOT   tools/test counts what ctest ran, and nothing that did not run has passed.

Runs tools/test with tools/tally in a folder of its own, where ctest is replaced by a program that writes the
results of a plan.
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))

# Stands for ctest: executes plan.py, whose function run(again) gives {test: {case: result} or status}.
CTEST = '''#!/usr/bin/env python3
import json, pathlib, re, sys
options = dict(zip(sys.argv, sys.argv[1:]))
if "-N" in sys.argv:
    print("  Test #1: Timed")
    sys.exit()
results = pathlib.Path(options["--test-dir"]) / "results"
results.mkdir(exist_ok=True)
regex = options.get("--tests-regex", "")
plan = {}
exec(pathlib.Path("plan.py").read_text(), plan)
junit = pathlib.Path(options["--output-junit"])
lines = []
chosen = plan["run"]("again" in junit.name)
if chosen == "no results":
    sys.exit(1)
for name, outcome in chosen.items():
    if not re.search(regex, name):
        continue
    is_suite = isinstance(outcome, dict)
    bad = is_suite and "failed" in outcome.values()
    status = "fail" if bad else "run" if is_suite else outcome
    inside = "<skipped message='Disabled'/>" if status == "disabled" else ""
    lines.append(f"<testcase name='{name}' status='{status}'>{inside}</testcase>")
    (results / f"{name}.suite").write_text("") if is_suite else None
    if is_suite and outcome:
        cases = [{"name": case, "result": "SKIPPED" if result == "skipped" else "COMPLETED",
                  **({"failures": [1]} if result == "failed" else {})} for case, result in outcome.items()]
        suite = [{"name": name, "testsuite": cases}]
        (results / f"{name}.json").write_text(json.dumps({"testsuites": suite}))
junit.write_text("<testsuite>" + "".join(lines) + "</testsuite>")
'''


class TestCommand(unittest.TestCase):
    def run_plan(self, first, again=None, output=""):
        """(last line, unsteady lines, exit code) of tools/test; `again`: results of the repetition; `output`:
        what ctest prints."""
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "tools").mkdir()
            (folder / "bin").mkdir()
            (folder / "build/release").mkdir(parents=True)
            (folder / "build/release/build.ninja").write_text("")
            for tool in ("test", "tally"):
                shutil.copy(ROOT / "tools" / tool, folder / "tools" / tool)
            for path, text in (("tools/install", "#!/bin/sh\n"), ("tools/build", "#!/bin/sh\n"),
                               ("bin/ctest", CTEST)):
                (folder / path).write_text(text)
                (folder / path).chmod(0o755)
            (folder / "plan.py").write_text(
                f"def run(again):\n  print({output!r})\n  return {again!r} if again else {first!r}\n")
            environment = dict(os.environ, PATH=f"{folder / 'bin'}:{os.environ['PATH']}")
            done = subprocess.run([folder / "tools/test", "--preset", "release"], cwd=folder, env=environment,
                                  capture_output=True, text=True)
        lines = done.stdout.splitlines()
        return lines[-1], [line for line in lines if line.startswith("UNSTEADY")], done.returncode

    def test_counts_cases_and_single_tests(self):
        self.assertEqual(self.run_plan({"A": {"a": "passed", "b": "passed"}, "script": "run"}),
                         ("3 passed, 0 failed", [], 0))

    def test_skipped_case_fails_also_beside_an_unsteady_one(self):
        first = {"Skips": {"a": "passed", "b": "skipped"}, "Timed": {"c": "failed"}}
        last, unsteady, code = self.run_plan(first, {"Timed": {"c": "passed"}})
        self.assertEqual((last, code), ("2 passed, 1 failed", 1))
        self.assertEqual(unsteady, ["UNSTEADY release: Timed.c, passed alone"])

    def test_case_without_the_label_timing_fails_although_it_passes_alone(self):
        last, unsteady, code = self.run_plan({"Flaky": {"c": "failed"}}, {"Flaky": {"c": "passed"}})
        self.assertEqual((last, unsteady, code), ("0 passed, 1 failed", [], 1))

    def test_skipped_case_alone_fails(self):
        self.assertEqual(self.run_plan({"Skips": {"b": "skipped"}}, {}), ("0 passed, 1 failed", [], 1))

    def test_disabled_or_missing_test_fails(self):
        self.assertEqual(self.run_plan({"a": "run", "b": "disabled"}, {"b": "run"}),
                         ("1 passed, 1 failed", [], 1))

    def test_case_that_fails_twice_fails(self):
        plan = {"A": {"a": "failed", "b": "passed"}}
        self.assertEqual(self.run_plan(plan, plan), ("1 passed, 1 failed", [], 1))

    def test_case_that_is_missing_in_the_repetition_fails(self):
        self.assertEqual(self.run_plan({"A": {"a": "failed", "b": "passed"}}, {"A": {"b": "passed"}}),
                         ("1 passed, 1 failed", [], 1))

    def test_suite_without_results_fails(self):
        self.assertEqual(self.run_plan({"A": {}, "b": "run"}, {}), ("1 passed, 1 failed", [], 1))

    def test_timed_script_that_passes_alone_is_unsteady(self):
        last, unsteady, code = self.run_plan({"Timed": "fail"}, {"Timed": "run"})
        self.assertEqual((last, len(unsteady), code), ("1 passed, 0 failed", 1, 0))
        self.assertEqual(self.run_plan({"a": "fail"}, {"a": "run"})[0], "0 passed, 1 failed")

    def test_finding_of_a_sanitizer_is_not_repeated(self):
        for finding in ("==7==ERROR: LeakSanitizer: detected memory leaks",
                        "WARNING: ThreadSanitizer: data race (pid=7)",
                        "a.cpp:3:5: runtime error: signed integer overflow"):
            last, unsteady, code = self.run_plan({"a": "fail"}, {"a": "run"}, finding)
            self.assertEqual((last, unsteady, code), ("0 passed, 1 failed", [], 1), finding)

    def test_sanitizer_that_fails_itself_is_repeated(self):
        crash = "==7==LeakSanitizer has encountered a fatal error."
        self.assertEqual(self.run_plan({"a": "fail"}, {"a": "run"}, crash)[0], "1 passed, 0 failed")

    def test_repetition_without_results_keeps_the_first_ones(self):
        last, unsteady, code = self.run_plan({"A": {"a": "failed", "b": "passed"}}, "no results")
        self.assertEqual((last, unsteady, code), ("1 passed, 2 failed", [], 1))

    def test_no_test_at_all_fails(self):
        self.assertEqual(self.run_plan({})[2], 1)


unittest.main()
