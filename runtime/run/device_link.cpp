#include "runtime/run/device_link.hpp"

#include <algorithm>
#include <cmath>

namespace hil::run {

DeviceLink::DeviceLink(io::Device& device, Links links, signals::SignalTable& table, io::Pacing pacing)
    : device_(device),
      links_(std::move(links)),
      table_(table),
      pacing_(pacing),
      samples_(device.inputs().size()),
      fresh_(device.input_groups().size(), 0),
      values_(device.outputs().size()) {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    values_[i] = device.outputs()[i].safe_value;
    for (signals::ReadObserver* const observer : table.read_observers({{links_.outputs[i].signal}}))
      observed_outputs_.push_back({device.send_cycle(i), observer});
  }
}

void DeviceLink::latch_inputs(std::int64_t time_ns) noexcept {
  device_.latch_inputs(samples_);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    table_.write(links_.inputs[i],
                 signals::SignalValue{samples_[i].value, samples_[i].time_ns, samples_[i].fresh});
  }
  if (links_.connected.valid()) table_.write(links_.connected, device_.connected() ? 1.0 : 0.0, time_ns);
  const auto groups = device_.input_groups();
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const auto inputs = std::span(samples_).subspan(groups[i].first, groups[i].count);
    const bool fresh =
        std::any_of(inputs.begin(), inputs.end(), [](const auto& input) { return input.fresh; });
    fresh_[i] = fresh ? 1 : 0;
    if (i < links_.fresh.size() && links_.fresh[i].valid())
      table_.write(links_.fresh[i], fresh ? 1.0 : 0.0, time_ns);
    if (i < links_.rejected.size() && links_.rejected[i].valid())
      table_.write(links_.rejected[i], static_cast<double>(device_.rejected(i).count), time_ns);
  }
}

void DeviceLink::step(const executive::TickInfo& tick) noexcept {
  if (!in_step_) return;
  for (std::size_t i = 0; i < values_.size(); ++i) {
    const Source& source = links_.outputs[i];
    const double value =
        source.signal.valid() ? source.conversion.of(table_.value(source.signal)) : source.constant;
    if (!std::isnan(value)) values_[i] = value;
    if (holds_safe_values_) values_[i] = device_.outputs()[i].safe_value;
  }
  for (const ObservedOutput& output : observed_outputs_) {
    if (!holds_safe_values_ && output.cycle.is_due(last_release_ns_, tick.time_ns))
      output.observer->note_read(signals::ReadBy::task);
  }
  last_release_ns_ = tick.time_ns;
  device_.release_outputs(values_, tick.time_ns);
  if (pacing_ == io::Pacing::lockstep) in_step_ = device_.exchange(tick.time_ns);
}

}  // namespace hil::run
