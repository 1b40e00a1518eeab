#pragma once
// The errors of questions about the history of a run.

#include <cstdint>
#include <stdexcept>
#include <string>

namespace hil::history {

/// A sentence for the user, and whether the question, the files or the GPU is at fault.
class HistoryError : public std::runtime_error {
 public:
  enum class Kind : std::uint8_t { question, file, gpu };
  HistoryError(Kind kind, const std::string& sentence) : std::runtime_error(sentence), kind_(kind) {}
  Kind kind() const noexcept { return kind_; }

 private:
  Kind kind_;
};

}  // namespace hil::history
