#include "io/can/signal_overlap.hpp"

#include "io/can/signal_codec.hpp"

namespace hil::io::can {

namespace {

/// Whether two ascending lists of ranges have a value in common.
bool have_common_value(const std::vector<MultiplexRange>& one, const std::vector<MultiplexRange>& other,
                       std::uint64_t& steps) {
  auto a = one.begin();
  auto b = other.begin();
  while (a != one.end() && b != other.end()) {
    ++steps;
    if (a->first <= b->last && b->first <= a->last) return true;
    if (a->last < b->last) {
      ++a;
    } else {
      ++b;
    }
  }
  return false;
}

}  // namespace

bool can_be_present_together(const DbcMessage& message, const DbcSignal& one, const DbcSignal& other,
                             std::uint64_t& steps) {
  const auto above = [&](const DbcSignal& signal) {
    return &message.signals[static_cast<std::size_t>(signal.multiplexer)];
  };
  for (const DbcSignal* a = &one; a->multiplexer >= 0; a = above(*a)) {
    for (const DbcSignal* b = &other; b->multiplexer >= 0; b = above(*b)) {
      ++steps;
      if (a->multiplexer != b->multiplexer) continue;
      if (!have_common_value(a->multiplex_ranges, b->multiplex_ranges, steps)) return false;
    }
  }
  return true;
}

std::vector<std::pair<std::size_t, std::size_t>> overlapping_pairs(const DbcMessage& message,
                                                                   std::size_t max_pairs) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  std::vector<PayloadBits> bits(message.signals.size());
  std::uint64_t steps = 0;
  for (std::size_t second = 0; second < bits.size() && steps < max_overlap_steps; ++second) {
    static_cast<void>(bits_of(message.signals[second], bits[second]));
    for (std::size_t first = 0; first < second && pairs.size() < max_pairs; ++first) {
      if ((bits[first] & bits[second]).none()) continue;
      if (can_be_present_together(message, message.signals[first], message.signals[second], steps))
        pairs.emplace_back(first, second);
    }
  }
  return pairs;
}

}  // namespace hil::io::can
