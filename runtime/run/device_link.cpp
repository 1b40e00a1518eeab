#include "runtime/run/device_link.hpp"

namespace hil::run {

DeviceLink::DeviceLink(io::Device& device, Links links, signals::SignalTable& table, io::Pacing pacing)
    : device_(device),
      links_(std::move(links)),
      table_(table),
      pacing_(pacing),
      samples_(device.inputs().size()),
      values_(device.outputs().size()) {}

void DeviceLink::latch_inputs() noexcept {
  device_.latch_inputs(samples_);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    table_.write(links_.inputs[i],
                 signals::SignalValue{samples_[i].value, samples_[i].time_ns, samples_[i].fresh});
  }
}

void DeviceLink::step(const executive::TickInfo& tick) noexcept {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const Source& source = links_.outputs[i];
    values_[i] = source.signal.valid() ? table_.value(source.signal) : source.constant;
  }
  device_.release_outputs(values_, tick.time_ns);
  if (pacing_ == io::Pacing::lockstep && in_step_) in_step_ = device_.exchange(tick.time_ns);
}

}  // namespace hil::run
