#pragma once
// What faults do to a signal: "x.faulted" follows "x" and is computed again at each write of it.
//
// Threads: made on the one that wires the run; the rest on the base thread, without allocation.

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "runtime/config/fault_section.hpp"
#include "runtime/injection/signal_fault.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::injection {

/// One fault of a signal: its action while it is active, and what readers had of it.
class SignalEffect {
 public:
  /// The section outlives it.
  explicit SignalEffect(const config::FaultSection& section) : section_(section) {}

  /// Before the first tick.
  void set_action(std::unique_ptr<SignalAction> action) noexcept { action_ = std::move(action); }
  void begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
    action_->begin_tick(table, time_ns);
  }
  /// The fault begins in this tick.
  void begin(std::int64_t time_ns) noexcept {
    is_active_ = true;
    began_ns_ = time_ns;
    action_->begin(time_ns);
  }
  void end() noexcept { is_active_ = false; }
  void act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept {
    if (is_active_) action_->act_on(signal, time_ns);
  }
  void keep(const signals::SignalValue& signal, std::int64_t time_ns) noexcept {
    action_->keep(signal, time_ns);
  }
  bool replaces_value() const noexcept { return is_active_ && action_->replaces_value(); }
  bool holds_last_value() const noexcept { return is_active_ && action_->holds_last_value(); }
  /// While both are active: whether it began after the other one.
  bool began_after(const SignalEffect& other) const noexcept { return began_ns_ > other.began_ns_; }
  const std::string& name() const noexcept { return section_.name.text; }
  /// A reader takes the value of the signal with faults. `is_true`: it is the true one. `replacing`: the
  /// later fault that replaces what this one does; null: none.
  void note_read(bool is_true, const SignalEffect* replacing) noexcept {
    if (!is_active_) return;
    was_read_ = true;
    if (replacing != nullptr) {
      note_replaced(replacing->name());
    } else if (action_->is_unknown()) {
      was_unknown_ = true;
    } else if (action_->acts()) {
      has_acted_ = true;
      took_effect_ |= !is_true;
    }
  }
  /// A fault of this name replaces the value that a reader takes.
  void note_replaced(std::string_view fault) noexcept {
    if (is_active_) was_read_ = true, replaced_by_ = fault;
  }
  /// What was so at least once while it was active: a reader took a value; one on which it acted; one that
  /// was not the true one.
  bool was_read() const noexcept { return was_read_; }
  bool has_acted() const noexcept { return has_acted_; }
  bool took_effect() const noexcept { return took_effect_; }
  /// Whether a reader took a value while that of the fault was unknown.
  bool was_unknown() const noexcept { return was_unknown_; }
  /// The later fault that replaced what it did when a reader took a value; empty: none.
  std::string_view replaced_by() const noexcept { return replaced_by_; }

 private:
  const config::FaultSection& section_;
  std::unique_ptr<SignalAction> action_;
  bool is_active_ = false;
  std::int64_t began_ns_ = 0;
  bool was_read_ = false, has_acted_ = false, took_effect_ = false, was_unknown_ = false;
  std::string_view replaced_by_{};
};

/// A signal with faults, which act one after the other. It observes the reads of the faulted signal.
class FaultySignal final : public signals::WriteFollower, public signals::ReadObserver {
 public:
  FaultySignal(signals::SignalId true_signal, signals::SignalId faulted_signal)
      : signal(true_signal), faulted(faulted_signal) {}

  const signals::SignalId signal, faulted;
  std::vector<const config::FaultSection*> sections;
  std::vector<SignalEffect*> effects;  ///< they outlive it
  std::vector<std::string> readers;    ///< for the report, with their periods

  /// Before the first tick. The table outlives the last tick.
  void open(signals::SignalTable& table) {
    table_ = &table;
    table.set_follower(signal, *this);
    true_signal_observers_ = table.read_observers({{signal}});
  }
  void begin_tick(std::int64_t time_ns) noexcept {
    time_ns_ = time_ns;
    follow(signal);
  }
  void follow(signals::SignalId signal) noexcept override;
  void note_read(signals::ReadBy by) noexcept override;
  void note_replaced(std::string_view fault) noexcept override;
  void end_tick() noexcept;

 private:
  signals::SignalValue value_with_faults() noexcept;
  /// The effect of this number acts on the value with the earlier effects.
  void act_on(signals::SignalValue& value, std::size_t number) noexcept;

  /// Whether the readers take the true value, but for the rounding of the faults.
  bool is_true() const noexcept;

  signals::SignalTable* table_ = nullptr;
  std::int64_t time_ns_ = 0;
  double largest_ = 0.0;  ///< of the magnitudes of the true value and of what each fault made of it
  /// Observers of the true signal: the readers also read it while no fault replaces its value.
  std::vector<signals::ReadObserver*> true_signal_observers_;
};

}  // namespace hil::injection
