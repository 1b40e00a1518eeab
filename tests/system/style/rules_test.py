#!/usr/bin/env python3
"""rules_test.py STYLE   breaks each rule of tools/style in a temporary tree, and expects to find it."""

import pathlib
import subprocess
import sys
import tempfile
import unittest

STYLE = sys.argv.pop(1)

# Files of a tree that breaks no rule.
GOOD = {
    "rtstdb/CMakeLists.txt": "# The database.\n",
    "rtstdb/include/rtstdb/row.hpp": '#pragma once\n#include <glm/vec3.hpp>\n#include <vector>\n',
    "rtstdb/include/rtstdb/store.hpp": '#pragma once\n#include "rtstdb/row.hpp"\n',
    "rtstdb/gpu/device.cpp": '#include <vulkan/vulkan_raii.hpp>\nvk::raii::Device device; // VK_SUCCESS\n',
    "io/CMakeLists.txt": "hil_library(io)\n",
    "io/README.md": "Bytes and signals.\n",
    "io/bus.cpp": '#include "io/bus.hpp"\nconst char* folder = "/tmp/bus"; // ~/work/bus, net/work/bus\n',
    "runtime/run.cpp": '#include "io/bus.hpp"\n#include "rtstdb/row.hpp"\nint lines[1];\n' + "\n" * 497,
    "tests/row_test.cpp": '#include "rtstdb/row.hpp"\nTEST(Row, IsThere) {}\n',
    "io/limits.hpp": '#pragma once\n#include "io/room.hpp"\nint least_significant_bit;  // room\n',
    "io/notes.md": "| " + "x " * 60 + "|\nhttps://" + "x" * 120 + "\n",
    "docs/architecture.md": "Buses: `io/bus.cpp: Bus`, `bus.*`, `b*.cpp`; headers end in `.hpp`.\n",
    "docs/picture.png": b"\x89PNG\xff",
}

# Rule, the file that breaks it, its content, and the place that must be named.
BREAKS = [
    ("vulkan_stays_in_rtstdb_gpu", "rtstdb/store/store.cpp", "\nvk::raii::Device device;\n",
     "rtstdb/store/store.cpp:2"),
    ("vulkan_stays_in_rtstdb_gpu", "runtime/cli.cpp", "#include <vulkan/vulkan.h>\n", "runtime/cli.cpp:1"),
    ("vulkan_stays_in_rtstdb_gpu", "io/a.cpp", "int x = VK_SUCCESS;\n", "io/a.cpp:1"),
    ("vulkan_stays_in_rtstdb_gpu", "bench/a.cpp", "void f() { vkDestroyDevice(); }\n", "bench/a.cpp:1"),
    ("dependencies_point_one_way", "io/a.cpp", '#include "rtstdb/entity.hpp"\n', "io/a.cpp:1"),
    ("dependencies_point_one_way", "io/a.cpp", "# include <runtime/config/scenario.hpp>\n", "io/a.cpp:1"),
    ("dependencies_point_one_way", "rtstdb/a.cpp", '\n\n#include "io/device.hpp"\n', "rtstdb/a.cpp:3"),
    ("dependencies_point_one_way", "runtime/a.cpp", '#include "tests/support/guard.hpp"\n',
     "runtime/a.cpp:1"),
    ("dependencies_point_one_way", "configs/a/modules/a.cpp", '#include "runtime/modules/registry.hpp"\n',
     "configs/a/modules/a.cpp:1"),
    ("dependencies_point_one_way", "configs/a/modules/a.cpp", '#include "rtstdb/gpu/device.hpp"\n',
     "configs/a/modules/a.cpp:1"),
    ("public_headers_stand_alone", "runtime/include/hil/a.hpp",
     "#pragma once\n#include <hil/world/world.hpp>\n", "runtime/include/hil/a.hpp:2"),
    ("public_headers_stand_alone", "runtime/include/hil/a.hpp",
     "#pragma once\n#include <rtstdb/entity.hpp>\n", "runtime/include/hil/a.hpp:2"),
    ("public_headers_stand_alone", "runtime/include/hil/world/a.hpp",
     '#pragma once\n#include "runtime/config/parse.hpp"\n', "runtime/include/hil/world/a.hpp:2"),
    ("public_headers_stand_alone", "rtstdb/include/rtstdb/a.hpp",
     "#pragma once\n#include <nlohmann/json.hpp>\n",
     "rtstdb/include/rtstdb/a.hpp:2"),
    ("public_headers_stand_alone",
     "rtstdb/include/rtstdb/a.hpp", '#pragma once\n#include "rtstdb/gpu/device.hpp"\n',
     "rtstdb/include/rtstdb/a.hpp:2"),
    ("includes_go_by_repository_path", "io/can/a.cpp", '#include "../device.hpp"\n', "io/can/a.cpp:1"),
    ("includes_go_by_repository_path", "shaders/a.comp", '#include "common/../shared/a.h"\n',
     "shaders/a.comp:1"),
    ("headers_are_read_once", "io/a.hpp", "int x;\n", "io/a.hpp"),
    ("nothing_is_left_for_later", "docs/a.md", "One.\nTO" "DO: two\n", "docs/a.md:2"),
    ("nothing_is_left_for_later", "io/a.cpp", "// FIX" "ME\n", "io/a.cpp:1"),
    ("no_test_is_switched_off", "tests/a_test.cpp", "TEST(Row, DISABLED_Moves) {}\n", "tests/a_test.cpp:1"),
    ("libraries_say_what_belongs_in_them", "io/can/CMakeLists.txt", "hil_library(can)\n",
     "io/can/CMakeLists.txt"),
    ("libraries_say_what_belongs_in_them", "rtstdb/store/CMakeLists.txt", "", "rtstdb/store/CMakeLists.txt"),
    ("nothing_names_one_machine", "configs/a.yaml", "mesh: /ho" "me/ann/car.obj\n", "configs/a.yaml:1"),
    ("maps_name_what_is_there", "docs/paper_map.md", "\nRays: `io/bus.cpp`, `ray_*.comp`.\n",
     "docs/paper_map.md:2"),
    ("maps_name_what_is_there", "io/README.md", "`io/gone.hpp: Bus`\n", "io/README.md:1"),
    ("lines_are_short", "io/a.cpp", "// " + "x " * 60 + "\n", "io/a.cpp:1: 123 columns"),
    ("lines_are_short", "io/CMakeLists.txt", "\n# " + "x " * 60 + "\n", "io/CMakeLists.txt:2"),
    ("names_are_plain", "io/a.cpp", "int crew_size;\n", "io/a.cpp:1: crew_size"),
    ("names_are_plain", "io/a.hpp", "#pragma once\nclass ProcessFate;\n", "io/a.hpp:2: ProcessFate"),
    ("names_are_plain", "shaders/build/a.comp", "uint most_rounds;\n", "shaders/build/a.comp:1"),
    ("nothing_names_one_machine", "README.md", "cd /wo" "rk/main\n", "README.md:1"),
]


def findings(files):
    with tempfile.TemporaryDirectory() as folder:
        for path, content in files.items():
            file = pathlib.Path(folder, path)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(content if isinstance(content, bytes) else content.encode())
        command = [STYLE, "--rules", "--root", folder]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout + done.stderr


class Rules(unittest.TestCase):
    def test_a_good_tree_breaks_none(self):
        self.assertEqual(findings(GOOD), (0, ""))

    def test_every_break_is_found_alone_with_its_place(self):
        for rule, path, content, place in BREAKS:
            with self.subTest(rule=rule, path=path):
                code, output = findings({**GOOD, path: content})
                self.assertEqual(code, 1)
                lines = output.splitlines()
                self.assertEqual(len(lines), 2, output)
                self.assertTrue(lines[0].startswith(place), output)
                self.assertTrue(lines[1].strip().startswith(rule + ": "), output)

    def test_a_tree_without_sources_is_refused(self):
        code, output = findings({"README.md": "x\n"})
        self.assertEqual(code, 1)
        self.assertIn("no sources", output)

    def test_sources_without_tidy_are_refused(self):
        for options in (["--rules"], ["--format"], []):
            with tempfile.TemporaryDirectory() as folder:
                command = [STYLE, *options, "--root", folder, "io/bus.cpp"]
                done = subprocess.run(command, capture_output=True, text=True, check=False)
            self.assertEqual(done.returncode, 2)
            self.assertIn("io/bus.cpp: only --tidy takes sources", done.stderr)


if __name__ == "__main__":
    unittest.main()
