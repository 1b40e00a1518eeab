#include "runtime/run/module_task.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "runtime/run/step_guard.hpp"

namespace hil::run {

ModuleTask::ModuleTask(std::string name, modules::AnyModule& module, Links links, std::int64_t deadline_ns,
                       signals::SignalTable& table, const rtstdb::Database* database,
                       const DeviceClock& run_clock, modules::EventLog& events, bool firm)
    : name_(std::move(name)),
      plain_(module.plain_module()),
      world_(module.world_module()),
      links_(std::move(links)),
      deadline_ns_(deadline_ns),
      table_(table),
      database_(database),
      run_clock_(run_clock) {
  for (const modules::Port& port : module.ports().inputs)
    inputs_.push_back({.value = port.initial});
  kept_inputs_ = inputs_;
  for (const modules::Port& port : module.ports().outputs)
    outputs_.push_back(port.initial);
  context_.inputs = inputs_;
  context_.outputs = outputs_;
  context_.events = &events;
  if (firm) context_.read_class = rtstdb::DeadlineClass::firm;
  std::vector<signals::SignalId> read;
  for (const signals::InputSource& source : links_.inputs)
    read.push_back(source.signal);
  read_observers_ = table_.read_observers(read);
}

void ModuleTask::latch_inputs(std::vector<signals::SignalValue>& inputs) noexcept {
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    const signals::InputSource& source = links_.inputs[i];
    if (!source.signal.valid()) continue;
    const signals::SignalValue& signal = table_.read(source.signal);
    if (std::isnan(signal.value)) {
      inputs[i].fresh = false;
      continue;
    }
    inputs[i] = signal;
    inputs[i].value = source.conversion.of(signal.value);
  }
  for (signals::ReadObserver* const observer : read_observers_)
    observer->note_read(signals::ReadBy::task);
}

rtstdb::Version ModuleTask::latest_version() const noexcept {
  return database_ == nullptr ? rtstdb::Version{} : database_->latest().version;
}

void ModuleTask::queue(const executive::TickInfo& /*tick*/) noexcept {
  std::copy(inputs_.begin(), inputs_.end(), kept_inputs_.begin());
  latch_inputs(kept_inputs_);
  kept_version_ = latest_version();
  kept_ = true;
}

void ModuleTask::latch(const executive::TickInfo& tick) noexcept {
  context_.run = tick.run;
  context_.time_ns = tick.time_ns;
  context_.period_ns = tick.period_ns;
  context_.deadline = rtstdb::clock_time_ns(run_clock_.origin_ns() + tick.time_ns + deadline_ns_);
  if (std::exchange(kept_, false)) {
    std::copy(kept_inputs_.begin(), kept_inputs_.end(), inputs_.begin());
    context_.version = kept_version_;
    return;
  }
  latch_inputs(inputs_);
  context_.version = latest_version();
}

void ModuleTask::step(const executive::TickInfo& tick) noexcept {
  context_.blocked_ns = 0;
  context_.gpu_ns = 0;
  context_.failure = rtstdb::Status::idle;
  context_.discarded = false;
  context_.hard_miss = {};
  if (has_failed()) return;
  try {
    const StepGuard guard(name_);
    if (world_ != nullptr)
      world_->step(context_);
    else
      plain_->step(context_);
  } catch (...) {
    fail(tick);
  }
  step_added_ns_ = added_ns_.load(std::memory_order_relaxed);
  if (step_added_ns_ > 0) longer_steps_.fetch_add(1, std::memory_order_relaxed);
  if (context_.hard_miss.lateness_ns > 0) {
    const HardMiss miss{context_.hard_miss, tick.tick};
    if (hard_misses_ < max_hard_misses) first_hard_misses_[hard_misses_] = miss;
    if (miss.lateness_ns > worst_hard_miss_.lateness_ns) worst_hard_miss_ = miss;
    ++hard_misses_;
  }
  discarded_runs_ += context_.discarded ? 1 : 0;
  if (context_.failure == rtstdb::Status::idle) return;
  if (runs_without_result_++ == 0) first_failure_ = context_.failure;
}

void ModuleTask::fail(const executive::TickInfo& tick) noexcept {
  const std::string thrown = text_of_exception();
  try {
    fault_ = name_ + " threw in its step of tick " + std::to_string(tick.tick) + ": " + thrown +
             "; its outputs are unknown from then on, and the run ended";
  } catch (...) {
    fault_.clear();  // no memory for the sentence
  }
  std::fill(outputs_.begin(), outputs_.end(), std::numeric_limits<double>::quiet_NaN());
  has_failed_.store(true, std::memory_order_release);
}

void ModuleTask::publish(const executive::TickInfo& tick) noexcept {
  for (std::size_t i = 0; i < outputs_.size(); ++i)
    table_.write(links_.outputs[i], outputs_[i], tick.time_ns);
}

}  // namespace hil::run
