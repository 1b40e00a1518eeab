#include <cstdio>
#include <cstdlib>

#include <hil/require.hpp>

namespace hil::config {

void stop_on_misuse(const char* rule, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: misuse: %s\n", file, line, rule);
  std::abort();
}

}  // namespace hil::config
