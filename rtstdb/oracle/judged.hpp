#pragma once
// A verdict with its reason in words. Internal to the oracle.

#include <cstdio>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

/// `format` and `values` as printf takes them; what is longer than a reason may be is cut off.
template <class... Values>
Judgement judged(Verdict verdict, const char* format, Values... values) {
  char text[320];
  std::snprintf(text, sizeof text, format, values...);
  return {verdict, text};
}

}  // namespace rtstdb::oracle
