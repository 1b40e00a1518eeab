#pragma once
// Checks the properties of materials and lights one by one and keeps the first fault.
//
// Threads: plain functions, any thread; a fault allocates.

#include <glm/ext/vector_double3.hpp>

#include <cstdio>
#include <optional>
#include <string>

#include <rtstdb/result.hpp>

namespace rtstdb {

class PropertyCheck {
 public:
  /// A value from `lowest` to `highest`. `allowed`: the range in words.
  void range(const char* property, double value, double lowest, double highest, const char* allowed) {
    // A NaN fails every comparison.
    if (!(value >= lowest && value <= highest)) refuse(property, value, allowed);
  }
  /// A value above 0.
  void positive(const char* property, double value, double highest, const char* allowed) {
    if (!(value > 0.0 && value <= highest)) refuse(property, value, allowed);
  }
  /// Three channels with one range.
  void channels(const char* property, const glm::dvec3& value, double lowest, double highest,
                const char* allowed) {
    for (int k = 0; k < 3; ++k)
      range((std::string(property) + "." + "rgb"[k]).c_str(), value[k], lowest, highest, allowed);
  }
  void refuse(const char* property, double value, const char* allowed) {
    if (fault_) return;
    char text[160];
    std::snprintf(text, sizeof text, "%s is %.9g; allowed is %s", property, value, allowed);
    fault_ = Error{ErrorCode::bad_input, text};
  }
  void refuse(const std::string& sentence) {
    if (!fault_) fault_ = Error{ErrorCode::bad_input, sentence};
  }

  Result<void> result() const { return fault_ ? Result<void>(*fault_) : Result<void>(); }

 private:
  std::optional<Error> fault_;
};

}  // namespace rtstdb
