#pragma once
// Root finding: the first instant at which a function of time changes its sign by more than its noise.
// Intervals that may contain a change are halved, the earlier half first.
//
// A BorderFunction is a function of time that knows on which side of a border it is and how fast it can
// change:
//     Sample at(ns)                     its value at an instant; Sample has a member `ns`
//     bool inside(sample)               whether the value is on the inner side
//     bool has_crossed(sample, member)  whether the value is, by more than the noise, on the other side than
//                                       a member (or non-member) is
//     bool certainly_stays(a, b, member)  true only if has_crossed is false everywhere in the interval
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
    crossing,   ///< a crossing at ns, the first nanosecond of the other state
    undecided,  ///< no crossing up to ns; the search reached max_samples and has to be continued from there
  } what = What::none;
  std::int64_t ns = 0;
};

/// Evaluations of the function in one search, which then takes at most some milliseconds.
inline constexpr int max_samples = 2048;

/// A stack of evaluations, the earliest on top. Elements are constructed when they are pushed, since most
/// searches use few.
template <class Sample, std::size_t most>
class SampleStack {
  static_assert(std::is_trivially_destructible_v<Sample>);

 public:
  bool empty() const { return count_ == 0; }
  void push(const Sample& sample) {
    RTSTDB_ASSERT(count_ < most, "the stack of samples is full");
    std::construct_at(at(count_), sample);
    ++count_;
  }
  const Sample& top() const { return *at(count_ - 1); }
  void pop() { --count_; }

 private:
  Sample* at(std::size_t i) { return reinterpret_cast<Sample*>(memory_.data()) + i; }
  const Sample* at(std::size_t i) const { return reinterpret_cast<const Sample*>(memory_.data()) + i; }

  alignas(Sample) std::array<std::byte, most * sizeof(Sample)> memory_;
  std::size_t count_ = 0;
};

/// Bisects to the first nanosecond of the new sign: the function has its old sign at `old_ns` and the new one
/// at `new_ns`.
template <class BorderFunction>
std::int64_t bisect_sign_change(const BorderFunction& function, std::int64_t old_ns, std::int64_t new_ns,
                                bool member) {
  while (new_ns - old_ns > 1) {
    const std::int64_t middle = std::midpoint(old_ns, new_ns);
    (function.inside(function.at(middle)) == member ? old_ns : new_ns) = middle;
  }
  return new_ns;
}

/// Searches (from_ns, to_ns]. If the value is already within the noise of the new side at from_ns, the
/// crossing is at from_ns.
template <class BorderFunction>
Crossing first_crossing(const BorderFunction& function, std::int64_t from_ns, std::int64_t to_ns,
                        bool member) {
  using Sample = typename BorderFunction::Sample;
  RTSTDB_ASSERT(from_ns <= to_ns, "the interval of time ends before it begins");
  if (from_ns == to_ns) return {Crossing::What::none, to_ns};
  SampleStack<Sample, 66> later;  // each interval is half as long as the one before: at most 63
  later.push(function.at(to_ns));
  Sample before = function.at(from_ns);
  std::optional<std::int64_t> old_ns;
  const auto note = [&](const Sample& sample) {
    if (function.inside(sample) == member) old_ns = sample.ns;
  };
  note(before);
  for (int samples = 2; !later.empty();) {
    const Sample& after = later.top();
    const bool passed = function.certainly_stays(before, after, member);
    if (!passed && after.ns - before.ns > 1) {
      if (++samples > max_samples && before.ns > from_ns) return {Crossing::What::undecided, before.ns};
      later.push(function.at(std::midpoint(before.ns, after.ns)));
      continue;
    }
    if (!passed && function.has_crossed(after, member))
      return {Crossing::What::crossing,
              old_ns ? bisect_sign_change(function, *old_ns, after.ns, member) : from_ns};
    before = after;
    note(before);
    later.pop();
  }
  return {Crossing::What::none, to_ns};
}

}  // namespace rtstdb::standing
