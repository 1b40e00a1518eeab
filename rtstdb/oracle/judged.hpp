#pragma once
// A verdict with its reason in words. Internal to the oracle.

#include <cstdio>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

/// `format` and `values` as for printf; a long text is truncated.
template <class... Values>
Judgement judged(Verdict verdict, const char* format, Values... values) {
  if constexpr (sizeof...(Values) == 0) {
    return {verdict, format};
  } else {
    char text[320];
    std::snprintf(text, sizeof text, format, values...);
    return {verdict, text};
  }
}

}  // namespace rtstdb::oracle
