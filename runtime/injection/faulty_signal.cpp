#include "runtime/injection/faulty_signal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hil::injection {

void FaultySignal::act_on(signals::SignalValue& value, std::size_t number) noexcept {
  if (std::isfinite(value.value)) largest_ = std::max(largest_, std::abs(value.value));
  effects[number]->act_on(value, time_ns_);
}

signals::SignalValue FaultySignal::value_with_faults() noexcept {
  signals::SignalValue value = table_->read(signal);
  largest_ = 0.0;
  for (std::size_t i = 0; i < effects.size(); ++i)
    act_on(value, i);
  return value;
}

void FaultySignal::follow(signals::SignalId /*signal*/) noexcept {
  table_->write(faulted, value_with_faults());
}

void FaultySignal::end_tick() noexcept {
  signals::SignalValue value = table_->read(signal);
  for (std::size_t i = 0; i < effects.size(); ++i) {
    effects[i]->keep(value, time_ns_);
    act_on(value, i);
  }
}

bool FaultySignal::is_true() const noexcept {
  const signals::SignalValue &taken = table_->read(faulted), &true_value = table_->read(signal);
  if (taken.fresh != true_value.fresh) return false;
  if (taken.value == true_value.value || (std::isnan(taken.value) && std::isnan(true_value.value)))
    return true;
  const double rounding = std::numeric_limits<double>::epsilon() * largest_;
  return std::abs(taken.value - true_value.value) <= 2.0 * static_cast<double>(effects.size()) * rounding;
}

void FaultySignal::note_read(signals::ReadBy by) noexcept {
  const bool is_true_value = is_true();
  const SignalEffect* replacing = nullptr;  // of the later faults: the first that replaces the value
  const SignalEffect* holding = nullptr;    // that holds its last value for the longest time
  for (auto next = effects.rbegin(); next != effects.rend(); ++next) {
    SignalEffect& effect = **next;
    // The last value has what the faults did that were active then.
    const bool is_held_off = replacing == nullptr && holding != nullptr && effect.began_after(*holding);
    effect.note_read(is_true_value, is_held_off ? holding : replacing);
    if (effect.replaces_value()) replacing = &effect;
    if (effect.holds_last_value() && (holding == nullptr || holding->began_after(effect))) holding = &effect;
  }
  for (signals::ReadObserver* observer : true_signal_observers_) {
    if (replacing != nullptr || holding != nullptr)
      observer->note_replaced((replacing != nullptr ? replacing : holding)->name());
    else
      observer->note_read(by);
  }
}

void FaultySignal::note_replaced(std::string_view fault) noexcept {
  for (SignalEffect* effect : effects)
    effect->note_replaced(fault);
  for (signals::ReadObserver* observer : true_signal_observers_)
    observer->note_replaced(fault);
}

}  // namespace hil::injection
