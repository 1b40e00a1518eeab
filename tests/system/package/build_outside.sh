#!/bin/sh
# Installs rtstdb from a build to a prefix of its own, then configures, builds and runs the consumer against it, all in a
# temporary folder outside the tree.
#   build_outside.sh BUILD_DIR CONSUMER_DIR CMAKE GENERATOR CXX_COMPILER CXX_FLAGS
set -eu
build_dir=$1 consumer_dir=$2 cmake=$3 generator=$4 compiler=$5 flags=$6

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$cmake" --install "$build_dir" --component rtstdb --prefix "$work/prefix"
# A copy, so that nothing is found by a path relative to the tree.
cp -r "$consumer_dir" "$work/consumer"
"$cmake" -S "$work/consumer" -B "$work/build" -G "$generator" -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags -Wall -Wextra -Wpedantic -Werror" \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
"$cmake" --build "$work/build"
# The installed headers must not include headers of the tree.
if grep -rn 'include "' "$work/prefix/include"; then
  echo "an installed header includes one that is not installed" >&2
  exit 1
fi
"$work/build/consumer"
