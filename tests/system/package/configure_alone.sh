#!/bin/sh
# With HIL_BUILD_RUNTIME=OFF the tree configures without looking for anything but rtstdb's own dependencies, and has no
# target but rtstdb's.
#   configure_alone.sh SOURCE_DIR CMAKE GENERATOR CXX_COMPILER
set -eu
source_dir=$1 cmake=$2 generator=$3 compiler=$4
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$cmake" -S "$source_dir" -B "$work" -G "$generator" -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="$compiler" \
  -DHIL_BUILD_RUNTIME=OFF -DCMAKE_DISABLE_FIND_PACKAGE_spdlog=ON -DCMAKE_DISABLE_FIND_PACKAGE_yaml-cpp=ON \
  -DCMAKE_DISABLE_FIND_PACKAGE_CLI11=ON \
  -DCMAKE_DISABLE_FIND_PACKAGE_PkgConfig=ON -DCMAKE_DISABLE_FIND_PACKAGE_GTest=ON
"$cmake" --build "$work" --target help > "$work/targets"
grep -q 'librtstdb\.a\|rtstdb: phony' "$work/targets"
if grep 'hil_io\|hil_runtime\|bench' "$work/targets"; then
  echo "targets of the runtime are built with rtstdb alone" >&2
  exit 1
fi
