#pragma once
// A hash of all answers of a scanner: runs with equal digests have equal answers.

#include <cstdint>

namespace hil::modules {

/// FNV-1a over words: the same on every machine.
class AnswerDigest {
 public:
  void add(std::uint32_t word) noexcept { value_ = (value_ ^ word) * 0x100000001B3ull; }
  /// As a number that a double holds exactly.
  double number() const noexcept { return static_cast<double>(value_ >> 11); }

 private:
  std::uint64_t value_ = 0xCBF29CE484222325ull;
};

}  // namespace hil::modules
