#pragma once
// Root finding: the first instant at which a function of time changes its sign by more than its noise.
// Intervals that may contain a change are halved, the earlier half first.
//
// A Gap is a function of time that knows on which side of a border it is and how fast it can change:
//     Look at(ns)                        its value at an instant; Look has a member `ns`
//     bool inside(look)                  whether the value is on the inner side
//     bool beyond(look, member)          whether the value is on the other side than a member (or non-member)
//                                        should be, by more than the noise
//     bool stays(a, b, member)           true only if it is beyond nowhere in the interval
// A value within the noise of the border leaves the state unchanged. The reported instant is that of the
// change of sign, not that at which the noise is exceeded.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numeric>
#include <optional>
#include <type_traits>

#include <rtstdb/result.hpp>

namespace rtstdb::standing {

struct Crossing {
  enum class What : std::uint8_t {
    none,       ///< no crossing up to ns, the end of the interval
    flip,       ///< a crossing at ns, the first nanosecond of the other state
    undecided,  ///< no crossing up to ns; the search reached max_looks and has to be continued from there
  } what = What::none;
  std::int64_t ns = 0;
};

/// Evaluations of the function in one search, which then takes at most some milliseconds.
inline constexpr int max_looks = 2048;

/// A stack of evaluations, the earliest on top. Elements are constructed when they are pushed, since most
/// searches use few.
template <class Look, std::size_t most>
class LookStack {
  static_assert(std::is_trivially_destructible_v<Look>);

 public:
  bool empty() const { return count_ == 0; }
  void push(const Look& look) {
    RTSTDB_ASSERT(count_ < most);
    std::construct_at(at(count_), look);
    ++count_;
  }
  const Look& top() const { return *at(count_ - 1); }
  void pop() { --count_; }

 private:
  Look* at(std::size_t i) { return reinterpret_cast<Look*>(memory_.data()) + i; }
  const Look* at(std::size_t i) const { return reinterpret_cast<const Look*>(memory_.data()) + i; }

  alignas(Look) std::array<std::byte, most * sizeof(Look)> memory_;
  std::size_t count_ = 0;
};

/// Bisects to the first nanosecond of the new sign: the function has its old sign at `old_ns` and the new one
/// at `beyond_ns`.
template <class Gap>
std::int64_t change_of_sign(const Gap& gap, std::int64_t old_ns, std::int64_t beyond_ns, bool member) {
  while (beyond_ns - old_ns > 1) {
    const std::int64_t middle = std::midpoint(old_ns, beyond_ns);
    (gap.inside(gap.at(middle)) == member ? old_ns : beyond_ns) = middle;
  }
  return beyond_ns;
}

/// Searches (from_ns, to_ns]. If the value is already within the noise of the new side at from_ns, the
/// crossing is at from_ns.
template <class Gap>
Crossing first_flip(const Gap& gap, std::int64_t from_ns, std::int64_t to_ns, bool member) {
  using Look = typename Gap::Look;
  RTSTDB_ASSERT(from_ns <= to_ns);
  if (from_ns == to_ns) return {Crossing::What::none, to_ns};
  LookStack<Look, 66> later;  // each interval is half as long as the one before: at most 63
  later.push(gap.at(to_ns));
  Look before = gap.at(from_ns);
  std::optional<std::int64_t> old_ns;
  const auto note = [&](const Look& look) {
    if (gap.inside(look) == member) old_ns = look.ns;
  };
  note(before);
  for (int looks = 2; !later.empty();) {
    const Look& after = later.top();
    const bool passed = gap.stays(before, after, member);
    if (!passed && after.ns - before.ns > 1) {
      if (++looks > max_looks && before.ns > from_ns) return {Crossing::What::undecided, before.ns};
      later.push(gap.at(std::midpoint(before.ns, after.ns)));
      continue;
    }
    if (!passed && gap.beyond(after, member))
      return {Crossing::What::flip, old_ns ? change_of_sign(gap, *old_ns, after.ns, member) : from_ns};
    before = after;
    note(before);
    later.pop();
  }
  return {Crossing::What::none, to_ns};
}

}  // namespace rtstdb::standing
