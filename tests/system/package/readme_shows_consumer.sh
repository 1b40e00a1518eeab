#!/bin/sh
# The example in a README is the consumer that is built and run: its cmake and cpp blocks are those files.
#   readme_shows_consumer.sh README CONSUMER_DIR
set -eu
readme=$1 consumer_dir=$2
block() { awk -v fence="\`\`\`$1" '$0 == fence { inside = 1; next } $0 == "```" { inside = 0 } inside' "$readme"; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
block cmake > "$work/CMakeLists.txt"
block cpp > "$work/main.cpp"
diff -u "$consumer_dir/CMakeLists.txt" "$work/CMakeLists.txt"
diff -u "$consumer_dir/main.cpp" "$work/main.cpp"
