#include <cstdio>
#include <cstdlib>
#include <string_view>

#include <rtstdb/result.hpp>

namespace rtstdb {

void assertion_failed(const char* fault, const char* file, int line) noexcept {
  // The path of the source in the repository, wherever that was built.
  const std::string_view path(file);
  const std::size_t begin = path.rfind("rtstdb/");
  const char* source = begin == std::string_view::npos ? file : file + begin;
  std::fprintf(stderr, "%s:%d: assertion failed: %s\n", source, line, fault);
  std::abort();
}

void misused(const char* call, const char* fault) noexcept {
  std::fprintf(stderr, "rtstdb was misused: %s: %s\n", call, fault);
  std::abort();
}

void value_of_error(const Error* error) noexcept {
  std::fprintf(stderr,
               "rtstdb was misused: Result::value: the result holds an error, check ok() first: %s: %s\n",
               error != nullptr ? to_string(error->code) : "no error",
               error != nullptr ? error->message.c_str() : "the result was moved from");
  std::abort();
}

void error_of_value() noexcept {
  misused("Result::error", "the result holds no error, check ok() first");
}

}  // namespace rtstdb
