#include "runtime/injection/faulty_signal.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <hil/unit.hpp>

namespace hil::injection {
namespace {

using FaultKind = config::FaultSection::Kind;

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

}  // namespace

FaultValueUnit fault_value_unit(FaultKind kind, const std::string& unit_of_signal) {
  if (kind == FaultKind::gain) return {};
  if (kind == FaultKind::stuck) return {unit_of_signal};
  const units::DifferenceUnit difference = units::difference_unit(unit_of_signal);
  const bool is_rate = kind == FaultKind::drift;
  return {difference.symbol, difference.factor, !is_rate, is_rate};
}

SignalEffect::SignalEffect(const config::FaultSection& section, std::int64_t base_period_ns,
                           std::uint64_t seed)
    : section_(section), random_(seed) {
  if (section.kind == FaultKind::delay)
    line_.emplace(static_cast<std::size_t>(section.duration_ns / base_period_ns) + 2);
}

void SignalEffect::begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  if (value_) number_ = value_->evaluate(table, time_ns, signals::Unpublished::initial_value) * value_factor_;
  // Drawn in each tick, so that one fault's numbers do not depend on when it is active.
  if (section_.kind == FaultKind::noise) number_ *= random_.normal();
  if (section_.kind == FaultKind::dropout) is_dropped_ = random_.uniform() < section_.share;
}

void SignalEffect::begin(std::int64_t time_ns) noexcept {
  is_active_ = true;
  takes_last_ = true;
  began_ns_ = time_ns;
}

bool SignalEffect::replaces_value() const noexcept {
  return is_active_ &&
         (section_.kind == FaultKind::stuck || (section_.kind == FaultKind::dropout && is_dropped_));
}

void SignalEffect::act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept {
  if (!is_active_) return;
  switch (section_.kind) {
    case FaultKind::stuck_at_last:
      if (std::exchange(takes_last_, false)) last_ = signal;
      signal = {last_.value, signal.time_ns, true};
      break;
    case FaultKind::stuck:
      signal = {number_, signal.time_ns, true};
      break;
    case FaultKind::offset:
    case FaultKind::noise:
      signal.value += number_;
      break;
    case FaultKind::gain:
      signal.value *= number_;
      break;
    case FaultKind::drift:
      signal.value += number_ * 1e-9 * static_cast<double>(time_ns - began_ns_);
      break;
    case FaultKind::delay:
      signal = line_->at(time_ns - section_.duration_ns, signal);
      break;
    case FaultKind::dropout:
      if (is_dropped_) signal = {no_value, signal.time_ns, false};
      break;
    default:  // no fault of a signal
      break;
  }
}

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
  const SignalEffect* holding = nullptr;    // that is stuck at its last value for the longest time
  for (auto next = effects.rbegin(); next != effects.rend(); ++next) {
    SignalEffect& effect = **next;
    // The last value has what the faults did that were active then.
    const bool is_held_off = replacing == nullptr && holding != nullptr && effect.began_after(*holding);
    effect.note_read(is_true_value, is_held_off ? holding : replacing);
    if (effect.replaces_value()) replacing = &effect;
    if (effect.is_stuck_at_last() && (holding == nullptr || holding->began_after(effect))) holding = &effect;
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
