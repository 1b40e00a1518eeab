#!/bin/sh
# take_out_module.sh PAGE DIR: the first two blocks of C++ of PAGE become DIR/range_finder.hpp and .cpp.
set -eu
mkdir -p "$2"
awk -v hpp="$2/range_finder.hpp" -v cpp="$2/range_finder.cpp" '
  $0 == "```cpp" { block++; inside = 1; next }
  $0 == "```" { inside = 0 }
  inside && block == 1 { print > hpp }
  inside && block == 2 { print > cpp }
  END { if (block < 2) exit 1 }' "$1"
