#!/bin/sh
# Installs hil from a build to a prefix of its own. Then builds and runs two plug-ins against it, in a temporary folder
# outside the tree: the module of PAGE, and the skeleton of `hil new module`. A target that links the database and
# hil::module is refused.
#   plugin_outside.sh BUILD_DIR PAGE CMAKE GENERATOR CXX_COMPILER CXX_FLAGS
set -eu
build_dir=$1 page=$2 cmake=$3 generator=$4 compiler=$5 flags=$6

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for component in hil rtstdb; do
  "$cmake" --install "$build_dir" --component $component --prefix "$work/prefix" >/dev/null
done
hil=$work/prefix/bin/hil

configure() {
  "$cmake" -S . -B build -G "$generator" -DCMAKE_CXX_COMPILER="$compiler" \
    -DCMAKE_CXX_FLAGS="$flags -Wall -Wextra -Wpedantic -Werror" -DCMAKE_PREFIX_PATH="$work/prefix" \
    -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
}
build_and_run() {  # SCENARIO
  configure
  "$cmake" --build build
  "$hil" check "$1"
  "$hil" run "$1" --out out
}

mkdir "$work/range_finder"
cd "$work/range_finder"
awk '
  /^## / { in_chapter = $0 == "## A module of your own" }
  $0 == "```" { file = "" }
  file != "" { print > file }
  in_chapter && $0 == "```cmake" { file = "CMakeLists.txt" }
  in_chapter && $0 == "```cpp" { file = "range_finder.cpp" }
  in_chapter && $0 == "```yaml" { file = "range.yaml" }' "$page"
build_and_run range.yaml

cd "$work"
"$hil" new module lag
cd lag
build_and_run lag.yaml

mkdir "$work/both"
cd "$work/both"
cat >CMakeLists.txt <<'CMAKE'
cmake_minimum_required(VERSION 3.25)
project(both LANGUAGES CXX)
find_package(hil 0.1 REQUIRED)
find_package(rtstdb 0.1 REQUIRED)
add_library(both MODULE both.cpp)
target_link_libraries(both PRIVATE hil::module rtstdb::rtstdb)
CMAKE
echo >both.cpp
if configure >configured 2>&1; then
  echo "a target that links hil::module and rtstdb::rtstdb is not refused" >&2
  exit 1
fi
grep -q RTSTDB_CODE configured

if grep -rn 'include "' "$work/prefix/include"; then
  echo "an installed header includes one that is not installed" >&2
  exit 1
fi
