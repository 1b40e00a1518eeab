#include "runtime/report/run_record.hpp"

namespace hil::report {
namespace {

constexpr std::array verdict_words{"passed",     "failed",      "timing_broken", "io_failed",
                                   "gpu_failed", "interrupted", "refused"};
constexpr std::array result_words{"held", "failed", "not checked"};
constexpr std::array layer_words{"ground", "road", "marking", "detector", "static", "pole", "vehicle", "ego"};

template <class Enum, std::size_t Count>
std::optional<Enum> enumerator_of(const std::array<const char*, Count>& words, const std::string& word) {
  for (std::size_t index = 0; index < Count; ++index) {
    if (word == words[index]) return static_cast<Enum>(index);
  }
  return std::nullopt;
}

}  // namespace

const char* to_string(ExpectationResult result) noexcept {
  return result_words[static_cast<std::size_t>(result)];
}

const char* to_string(Verdict verdict) noexcept {
  return verdict_words[static_cast<std::size_t>(verdict)];
}

const char* to_string(Layer layer) noexcept {
  return layer_words[static_cast<std::size_t>(layer)];
}

std::optional<ExpectationResult> expectation_result_from(const std::string& word) {
  return enumerator_of<ExpectationResult>(result_words, word);
}

std::optional<Verdict> verdict_from(const std::string& word) {
  return enumerator_of<Verdict>(verdict_words, word);
}

std::optional<Layer> layer_from(const std::string& word) {
  return enumerator_of<Layer>(layer_words, word);
}

}  // namespace hil::report
