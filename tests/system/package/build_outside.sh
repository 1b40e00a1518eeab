#!/bin/sh
# Installs rtstdb from a build to a prefix of its own, then configures, builds and runs the consumer against it, all in a
# temporary folder outside the tree.
#   build_outside.sh BUILD_DIR CONSUMER_DIR CMAKE GENERATOR CXX_COMPILER CXX_FLAGS [PAGE]
# With a PAGE of Markdown, its block of C++ with a main function is built instead of the consumer's, and has to print the
# page's next block of text.
set -eu
build_dir=$1 consumer_dir=$2 cmake=$3 generator=$4 compiler=$5 flags=$6

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

"$cmake" --install "$build_dir" --component rtstdb --prefix "$work/prefix"
# A copy, so that nothing is found by a path relative to the tree.
cp -r "$consumer_dir" "$work/consumer"
if [ $# -gt 6 ]; then
  awk -v program="$work/consumer/main.cpp" -v text="$work/expected" '
    /^```[a-z]+$/ { language = substr($0, 4); block = ""; next }
    $0 == "```" && language == "cpp" && block ~ /\nint main\(/ { programs++; printf "%s", block > program }
    $0 == "```" && language == "text" && programs == 1 && !texts++ { printf "%s", block > text }
    $0 == "```" { language = "" }
    language != "" { block = block $0 "\n" }
    END { if (programs != 1 || texts == 0) exit 1 }' "$7"
fi
"$cmake" -S "$work/consumer" -B "$work/build" -G "$generator" -DCMAKE_BUILD_TYPE=Release \
  -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags -Wall -Wextra -Wpedantic -Werror" \
  -DCMAKE_PREFIX_PATH="$work/prefix" -DCMAKE_FIND_USE_PACKAGE_REGISTRY=OFF
"$cmake" --build "$work/build"
# The installed headers must not include headers of the tree.
if grep -rn 'include "' "$work/prefix/include"; then
  echo "an installed header includes one that is not installed" >&2
  exit 1
fi
"$work/build/consumer" > "$work/printed"
cat "$work/printed"
if [ $# -gt 6 ]; then
  diff -u "$work/expected" "$work/printed"
fi
