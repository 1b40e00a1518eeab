#pragma once
// Results and errors. Three kinds of failure, never mixed:
//   misuse of the API   an assertion that stays on in release builds (RTSTDB_REQUIRE)
//   bad input           refused with its values: Result<T> at setup, Outcome::bad_input in transactions
//   expected events     a missed deadline, an overflow, a lost device: values in the result

#include <optional>
#include <string>
#include <utility>
#include <variant>

namespace rtstdb {

enum class ErrorCode : unsigned char {
  bad_input,      ///< a value that is not allowed; the message holds it
  no_device,      ///< no Vulkan device, or none that has what rtstdb needs
  capacity,       ///< a limit of limits.hpp or of the database's options would be exceeded
  file,           ///< a file cannot be read or written, or has wrong contents
  device_lost,    ///< the GPU stopped answering
  out_of_memory,  ///< host or device memory
};
const char* to_string(ErrorCode code) noexcept;

/// An error code with one sentence, which holds the values and is fit to be shown to the user.
struct Error {
  ErrorCode code = ErrorCode::bad_input;
  std::string message{};
};

/// Each prints the misused public function and the fault to stderr, then aborts. value_of_error adds the
/// message of the error; null: the result was moved from.
[[noreturn]] void misused(const char* call, const char* fault) noexcept;
[[noreturn]] void value_of_error(const Error* error) noexcept;
[[noreturn]] void error_of_value() noexcept;

/// A value or an Error. Misuse (aborts): `value()` of an error, which prints the error's message, and
/// `error()` of a value.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  Result(Error error)
      : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  bool ok() const noexcept { return state_.index() == 0; }
  explicit operator bool() const noexcept { return ok(); }
  T& value() & {
    if (T* value = std::get_if<0>(&state_)) return *value;
    value_of_error(std::get_if<1>(&state_));
  }
  const T& value() const& {
    if (const T* value = std::get_if<0>(&state_)) return *value;
    value_of_error(std::get_if<1>(&state_));
  }
  T&& value() && { return std::move(value()); }
  const Error& error() const {
    if (const Error* error = std::get_if<1>(&state_)) return *error;
    error_of_value();
  }

 private:
  std::variant<T, Error> state_;
};

template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : error_(std::move(error)) {}  // NOLINT(google-explicit-constructor)
  bool ok() const noexcept { return !error_; }
  explicit operator bool() const noexcept { return ok(); }
  void value() const {
    if (error_) value_of_error(&*error_);
  }
  const Error& error() const {
    if (error_) return *error_;
    error_of_value();
  }

 private:
  std::optional<Error> error_;
};

/// Prints the fault with its line in a source of the repository, then aborts.
[[noreturn]] void assertion_failed(const char* fault, const char* file, int line) noexcept;

}  // namespace rtstdb

/// REQUIRE checks a rule for the caller of a public function, ASSERT one inside the database. Both abort if
/// the rule is false, in release builds too. `fault` is a sentence that says what is wrong; that of REQUIRE
/// also says what to do instead.
#define RTSTDB_REQUIRE(rule, call, fault) ((rule) ? static_cast<void>(0) : ::rtstdb::misused(call, fault))
#define RTSTDB_ASSERT(rule, fault) \
  ((rule) ? static_cast<void>(0) : ::rtstdb::assertion_failed(fault, __FILE__, __LINE__))
