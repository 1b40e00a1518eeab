#pragma once
// Strings that break documents which do not escape.

#include <string>
#include <vector>

namespace hil::report::test {

inline std::vector<std::string> hostile_texts() {
  return {"<script>alert(1)</script>",
          "\"><img src=x onerror=alert(1)>",
          "' onload='x",
          "]]>",
          "<!--",
          "&amp; &lt; &#0; &unknown;",
          "a\nb\tc\rd",
          std::string("nul\0inside", 10),
          "\x1b[31mred\x1b[0m\x07",
          "\xff\xfe broken \xc3(",
          "\xed\xa0\x80 surrogate",
          "\xc0\xaf overlong",
          "\xf4\x90\x80\x80 past the end",
          "cut short \xe2\x82",
          "\xef\xbf\xbe not a character",
          "\xc2\x85 next line",
          "</style></svg></html>",
          "µ ü 漢字 😀"};
}

}  // namespace hil::report::test
