#pragma once
// The parts of the generator SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number
// generators", 2014), for numbers that depend on what they belong to and not on the order of the draws.
//
// Threads: pure functions.

#include <cstdint>

namespace hil::modules {

/// By this much the state of the generator advances from one number to the next.
inline constexpr std::uint64_t splitmix64_step = 0x9E3779B97F4A7C15u;

/// The finalizer of the generator, a bijection: each bit of the result depends on all bits of `word`.
constexpr std::uint64_t splitmix64_finalizer(std::uint64_t word) noexcept {
  word = (word ^ (word >> 30)) * 0xBF58476D1CE4E5B9u;
  word = (word ^ (word >> 27)) * 0x94D049BB133111EBu;
  return word ^ (word >> 31);
}

/// The number that the generator draws in this state.
constexpr std::uint64_t splitmix64(std::uint64_t state) noexcept {
  return splitmix64_finalizer(state + splitmix64_step);
}

}  // namespace hil::modules
