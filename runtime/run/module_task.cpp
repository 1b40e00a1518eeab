#include "runtime/run/module_task.hpp"

namespace hil::run {

ModuleTask::ModuleTask(modules::Module& module, Links links, std::int64_t deadline_ns,
                       signals::SignalTable& table, const rtstdb::Database& database,
                       const DeviceClock& run_clock, modules::EventLog& events)
    : module_(module),
      links_(std::move(links)),
      deadline_ns_(deadline_ns),
      table_(table),
      database_(database),
      run_clock_(run_clock) {
  for (const modules::Port& port : module.ports().inputs)
    inputs_.push_back({.value = port.initial});
  for (const modules::Port& port : module.ports().outputs)
    outputs_.push_back(port.initial);
  context_.inputs = inputs_;
  context_.outputs = outputs_;
  context_.events = &events;
}

void ModuleTask::latch(const executive::TickInfo& tick) noexcept {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    if (links_.inputs[i].valid()) inputs_[i] = table_.read(links_.inputs[i]);
  }
  context_.run = tick.run;
  context_.time_ns = tick.time_ns;
  context_.period_ns = tick.period_ns;
  context_.deadline = rtstdb::clock_time_ns(run_clock_.origin_ns() + tick.time_ns + deadline_ns_);
  context_.version = database_.latest().version;
}

void ModuleTask::step(const executive::TickInfo& /*tick*/) noexcept {
  context_.blocked_ns = 0;
  context_.gpu_ns = 0;
  module_.step(context_);
}

void ModuleTask::publish(const executive::TickInfo& tick) noexcept {
  for (std::size_t i = 0; i < outputs_.size(); ++i)
    table_.write(links_.outputs[i], outputs_[i], tick.time_ns);
}

}  // namespace hil::run
