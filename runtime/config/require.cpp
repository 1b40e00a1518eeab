#include "runtime/config/require.hpp"

#include <cstdio>
#include <cstdlib>

namespace hil::config {

void stop_on_misuse(const char* rule, const std::source_location& where) {
  std::fprintf(stderr, "%s:%u: %s: misuse: %s\n", where.file_name(), where.line(), where.function_name(),
               rule);
  std::abort();
}

}  // namespace hil::config
