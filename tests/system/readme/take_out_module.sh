#!/bin/sh
# take_out_module.sh PAGE DIR: the first block of C++ of PAGE becomes DIR/range_finder.cpp.
set -eu
mkdir -p "$2"
awk -v cpp="$2/range_finder.cpp" '
  $0 == "```cpp" { block++; inside = 1; next }
  $0 == "```" { inside = 0 }
  inside && block == 1 { print > cpp }
  END { if (block < 1) exit 1 }' "$1"
