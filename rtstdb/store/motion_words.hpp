#pragma once
// A motion as an array of 64-bit words, bit for bit. The log uses it to find the words that a write leaves
// unchanged and need not repeat.
//
// Pure functions: any thread, no allocation, fit for the tick.

#include <array>
#include <bit>
#include <cstdint>

#include <rtstdb/entity.hpp>

namespace rtstdb::store {

/// Position, orientation (w, x, y, z), velocity, angular velocity, valid_from.
using MotionWords = std::array<std::uint64_t, 14>;

inline MotionWords words_of(const Motion& motion) noexcept {
  const auto word = [](double number) { return std::bit_cast<std::uint64_t>(number); };
  const auto& [p, q, v, w, valid_from] = motion;
  return {word(p.x), word(p.y),
          word(p.z), word(q.w),
          word(q.x), word(q.y),
          word(q.z), word(v.x),
          word(v.y), word(v.z),
          word(w.x), word(w.y),
          word(w.z), static_cast<std::uint64_t>(valid_from.time_since_epoch().count())};
}

inline Motion motion_of(const MotionWords& words) noexcept {
  const auto number = [&](std::size_t k) { return std::bit_cast<double>(words[k]); };
  return {{number(0), number(1), number(2)},
          {number(3), number(4), number(5), number(6)},
          {number(7), number(8), number(9)},
          {number(10), number(11), number(12)},
          world_time_ns(static_cast<std::int64_t>(words[13]))};
}

/// Bit k: word k is equal in both, bit for bit (0.0 and -0.0 differ).
inline std::uint16_t same_words(const MotionWords& a, const MotionWords& b) noexcept {
  std::uint32_t same = 0;
  for (std::size_t k = 0; k < a.size(); ++k)
    same |= std::uint32_t{a[k] == b[k]} << k;
  return static_cast<std::uint16_t>(same);
}

/// The number of bits set. (std::popcount is a function call unless the compiler may use the instruction.)
constexpr std::uint32_t count_of_words(std::uint16_t mask) noexcept {
  std::uint32_t sums = mask;
  sums = (sums & 0x5555u) + (sums >> 1 & 0x5555u);
  sums = (sums & 0x3333u) + (sums >> 2 & 0x3333u);
  sums = (sums & 0x0F0Fu) + (sums >> 4 & 0x0F0Fu);
  return (sums & 0xFFu) + (sums >> 8);
}

inline constexpr std::uint16_t all_motion_words = (1u << std::tuple_size_v<MotionWords>)-1;

}  // namespace rtstdb::store
