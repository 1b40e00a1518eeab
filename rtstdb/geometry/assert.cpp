#include <cstdio>
#include <cstdlib>

#include <rtstdb/result.hpp>

namespace rtstdb {

void assertion_failed(const char* rule, const char* file, int line) noexcept {
  std::fprintf(stderr, "%s:%d: rtstdb was misused: %s\n", file, line, rule);
  std::abort();
}

}  // namespace rtstdb
