#pragma once
// When a stimulus or a fault is active (config/activation_section.hpp).
//
// Threads: compile on the one that wires the run; update once a tick, on the base thread, without allocation;
// the counts after the run.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runtime/config/activation_section.hpp"
#include "runtime/injection/random_numbers.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::injection {

class Activation {
 public:
  /// Empty with mistakes. `seed`: of this activation.
  static std::optional<Activation> compile(const config::ActivationSection& section,
                                           const signals::KnownSignals& known, std::int64_t period_ns,
                                           std::uint64_t seed, config::Diagnostics& diagnostics);

  enum class Change : std::uint8_t { none, begins, ends };
  /// At the begin of a tick. A begin by time is in the first tick that is not before it. A condition that is
  /// true in the first tick begins there; after an end, it begins where the condition becomes true again.
  Change update(const signals::SignalTable& table, std::int64_t time_ns) noexcept;

  bool is_active() const noexcept { return is_active_; }
  /// While it is active: run time of the tick in which it began.
  std::int64_t began_ns() const noexcept { return began_ns_; }

  std::uint64_t begins() const noexcept { return begins_; }
  std::optional<std::int64_t> first_begin_ns() const noexcept { return first_begin_ns_; }
  /// The first max_spans times that it was active.
  static constexpr std::size_t max_spans = 100;
  struct Span {
    std::int64_t begin_ns = 0;
    std::int64_t end_ns = std::numeric_limits<std::int64_t>::max();  ///< while it is active
  };
  std::span<const Span> spans() const noexcept { return spans_; }
  /// Whether it has begun.
  bool has_begun() const noexcept { return first_begin_ns_.has_value(); }
  /// Why it has not begun, as a clause for the report: each draw of its probability was lost. Empty: it was
  /// not drawn.
  std::string lost_draws() const;
  /// How long it was active, up to the end of the run.
  std::int64_t active_ns(std::int64_t end_ns) const noexcept;

 private:
  Activation(const config::ActivationSection& section, std::uint64_t seed);
  bool has_ended(double until, double in_while, std::int64_t time_ns) const noexcept;
  /// Whether it is due in this tick, and used up.
  bool is_due(double condition, std::int64_t time_ns) noexcept;
  bool draw() noexcept;

  config::ActivationSection section_;
  std::optional<signals::SignalExpression> when_, while_, until_;
  RandomNumbers random_;
  std::int64_t next_begin_ns_ = 0;
  bool was_true_ = false;  ///< the condition, where it was last known
  bool is_active_ = false;
  std::int64_t began_ns_ = 0;
  std::uint64_t begins_ = 0, draws_ = 0;
  std::optional<std::int64_t> first_begin_ns_;
  std::int64_t ended_active_ns_ = 0;  ///< of activations that have ended
  std::vector<Span> spans_;
};

}  // namespace hil::injection
