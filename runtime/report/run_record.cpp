#include "runtime/report/run_record.hpp"

#include "runtime/contract/words.hpp"

namespace hil::report {
namespace {

constexpr std::array verdict_words{"passed",    "completed",  "failed",      "timing_broken",
                                   "io_failed", "gpu_failed", "interrupted", "refused"};
constexpr std::array series_kind_words{"signal", "faulted", "reference"};
constexpr std::array result_words{"held", "failed", "not_checked"};

}  // namespace

const char* to_string(ExpectationResult result) noexcept {
  return result_words[static_cast<std::size_t>(result)];
}

const char* to_string(Verdict verdict) noexcept {
  return verdict_words[static_cast<std::size_t>(verdict)];
}

const char* to_string(SeriesKind kind) noexcept {
  return series_kind_words[static_cast<std::size_t>(kind)];
}

const char* words_of(ExpectationResult result) noexcept {
  return result == ExpectationResult::not_checked ? "not checked" : to_string(result);
}

std::optional<ExpectationResult> expectation_result_from(const std::string& word) {
  return contribution::enumerator_of<ExpectationResult>(result_words, word);
}

std::optional<Verdict> verdict_from(const std::string& word) {
  return contribution::enumerator_of<Verdict>(verdict_words, word);
}

std::optional<SeriesKind> series_kind_from(const std::string& word) {
  return contribution::enumerator_of<SeriesKind>(series_kind_words, word);
}

}  // namespace hil::report
