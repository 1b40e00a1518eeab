#pragma once
// The first instant at which a gap changes its sign for good enough, by halving intervals in which it may, the earlier half first.
//
// A Gap is a function of time that knows on which side of a border it is and how fast it can change:
//     Look at(ns)                        what it is at an instant; Look has `ns`
//     bool inside(look)                  its side of the border
//     bool beyond(look, member)          whether it is certainly on the other side than a member / no member: past its noise
//     bool stays(a, b, member)           true only if it is beyond nowhere within the interval
// Who rests on the border, within the noise, stays what it was. The instant is that of the sign, not of the noise's end.

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
    none,       ///< nothing until ns, the end
    flip,       ///< at ns: the first nanosecond of the other state
    undecided,  ///< nothing until ns; many looks were taken, go on from there
  } what = What::none;
  std::int64_t ns = 0;
};

/// So many looks are taken at once: some milliseconds.
inline constexpr int max_looks = 2048;

/// Looks that come later, the next one on top. They are made when they are pushed: there is room for more than most searches need.
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

/// The last change of sign before `beyond_ns`, where the gap is on the other side; at `old_ns` its sign is still the old one.
template <class Gap>
std::int64_t change_of_sign(const Gap& gap, std::int64_t old_ns, std::int64_t beyond_ns, bool member) {
  while (beyond_ns - old_ns > 1) {
    const std::int64_t middle = std::midpoint(old_ns, beyond_ns);
    (gap.inside(gap.at(middle)) == member ? old_ns : beyond_ns) = middle;
  }
  return beyond_ns;
}

/// Within (from_ns, to_ns]; a flip within its noise of the beginning is at from_ns.
template <class Gap>
Crossing first_flip(const Gap& gap, std::int64_t from_ns, std::int64_t to_ns, bool member) {
  using Look = typename Gap::Look;
  RTSTDB_ASSERT(from_ns <= to_ns);
  if (from_ns == to_ns) return {Crossing::What::none, to_ns};
  LookStack<Look, 66> later;  // intervals get half as long each: 63 at most
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
