// What a CanDeviceConfig must hold to, the channels that follow from it, and the faults that fit it.

#include <algorithm>
#include <cmath>
#include <set>

#include "io/can/can_device.hpp"
#include "io/can/identifier_text.hpp"

namespace hil::io::can {

namespace {

/// Checks one named message; null when the database does not have it.
const DbcMessage* check_message(const CanDeviceConfig& config, const std::string& name,
                                const Protection& protection,
                                const std::map<std::string, double>& safe_values, Use use,
                                std::vector<std::string>& problems) {
  const std::string bus = "CAN bus '" + config.name + "': ";
  const DbcMessage* const message = config.database.find_message(name);
  if (message == nullptr) {
    problems.push_back(bus + "the database has no message '" + name + "'");
    return nullptr;
  }
  for (const std::string& problem : coding_problems(*message, protection, use))
    problems.push_back(bus + problem);
  for (const auto& [signal, value] : safe_values) {
    std::string problem = bus;
    problem.append("the safe value of '").append(name).append(".").append(signal).append("' ");
    if (message->find_signal(signal) == nullptr) {
      problems.push_back(problem.append("belongs to a signal that the message does not have"));
    } else if (!std::isfinite(value)) {
      problems.push_back(problem.append("is not a finite number"));
    }
  }
  return message;
}

ChannelInfo channel_of(const DbcMessage& message, std::size_t signal_index, const SignalCodec& codec,
                       const std::map<std::string, double>& safe_values) {
  const DbcSignal& signal = message.signals[signal_index];
  ChannelInfo channel;
  channel.name = message.name + "." + signal.name;
  channel.unit = signal.unit;
  channel.minimum = codec.physical_minimum();
  channel.maximum = codec.physical_maximum();
  const auto safe = safe_values.find(signal.name);
  channel.safe_value =
      safe != safe_values.end() ? safe->second : std::clamp(0.0, channel.minimum, channel.maximum);
  return channel;
}

}  // namespace

std::vector<std::string> configuration_problems(const CanDeviceConfig& config) {
  std::vector<std::string> problems;
  const std::string bus = "CAN bus '" + config.name + "': ";
  std::set<std::string> named;
  const auto once = [&](const std::string& message) {
    if (!named.insert(message).second) problems.push_back(bus + "message '" + message + "' is named twice");
  };
  for (const SentMessageConfig& sent : config.send) {
    once(sent.message);
    check_message(config, sent.message, sent.protection, sent.safe_values, Use::send, problems);
    if (sent.period_ns < 0 || sent.offset_ns < 0) {
      problems.push_back(bus + "message '" + sent.message + "' has a negative period or offset");
    }
  }
  for (const ReceivedMessageConfig& received : config.receive) {
    once(received.message);
    check_message(config, received.message, received.protection, received.safe_values, Use::receive,
                  problems);
    if (received.timeout_ns < 0) {
      problems.push_back(bus + "message '" + received.message + "' has a negative time-out");
    }
  }
  if (!(config.bits_per_second > 0.0)) problems.push_back(bus + "the bit rate is not above zero");
  return problems;
}

void CanDevice::add_sent(const SentMessageConfig& config) {
  const DbcMessage& message = *config_.database.find_message(config.message);
  Sent sent{message.name,
            MessageEncoder(message, config.protection),
            config.period_ns,
            config.offset_ns,
            std::vector<double>(message.signals.size(), 0.0),
            {},
            outputs_.size(),
            std::nullopt};
  const MessageLayout& layout = sent.encoder.layout();
  for (std::size_t signal = 0; signal < message.signals.size(); ++signal) {
    ChannelInfo channel = channel_of(message, signal, layout.codec(signal), config.safe_values);
    if (signal == layout.counter()) {
      sent.counter_input = inputs_.size();
      inputs_.push_back(std::move(channel));
      input_timeout_ns_.push_back(0);
    } else if (signal != layout.checksum()) {
      sent.output_signal.push_back(signal);
      sent.values[signal] = channel.safe_value;
      safe_outputs_.push_back(channel.safe_value);
      outputs_.push_back(std::move(channel));
    }
  }
  sent_.push_back(std::move(sent));
}

void CanDevice::add_received(const ReceivedMessageConfig& config) {
  const DbcMessage& message = *config_.database.find_message(config.message);
  const MessageDecoder decoder(message, config.protection);
  Received received{
      .decoder = decoder, .without_faults = decoder, .first_input = inputs_.size(), .message = message.name};
  received.counts->faulted_values = std::vector<Count>(message.signals.size());
  if (!message.signals.empty()) {
    groups_.push_back({.name = message.name,
                       .first = inputs_.size(),
                       .count = message.signals.size(),
                       .timeout_ns = config.timeout_ns,
                       .can_reject = true});
    received_of_group_.push_back(received_.size());
  }
  for (std::size_t signal = 0; signal < message.signals.size(); ++signal) {
    inputs_.push_back(
        channel_of(message, signal, received.decoder.layout().codec(signal), config.safe_values));
    input_timeout_ns_.push_back(config.timeout_ns);
  }
  received_by_id_.emplace(received.decoder.layout().can_id(), received_.size());
  received_.push_back(std::move(received));
}

const MessageLayout* CanDevice::layout_of(const std::string& message) const {
  const auto identifier = identifier_in(message);
  for (const Sent& sent : sent_) {
    if (sent.message == message || sent.encoder.layout().can_id() == identifier)
      return &sent.encoder.layout();
  }
  for (const Received& received : received_) {
    if (received.message == message || received.decoder.layout().can_id() == identifier)
      return &received.decoder.layout();
  }
  return nullptr;
}

std::string CanDevice::other_messages() const {
  constexpr std::size_t max_listed = 20;
  std::string names;
  std::size_t count = 0;
  const auto add = [&](const std::string& name) {
    if (++count <= max_listed) names += (count == 1 ? "; it sends or receives " : ", ") + name;
  };
  for (const Sent& sent : sent_)
    add(sent.message);
  for (const Received& received : received_)
    add(received.message);
  if (count > max_listed) names += " and " + std::to_string(count - max_listed) + " more";
  return names;
}

std::vector<PlayedFrame> CanDevice::played_frames(std::optional<canid_t> identifier) const {
  std::vector<PlayedFrame> frames;
  if (!identifier || !config_.playback) return frames;
  for (const PlayedFrame& frame : *config_.playback->frames)
    if ((frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK)) == *identifier) frames.push_back(frame);
  return frames;
}

std::string CanDevice::fault_problem(const std::string& message, const FrameFault& fault) const {
  if (const MessageLayout* const layout = layout_of(message)) return fault.problem(*layout);
  const std::vector<PlayedFrame> played = played_frames(identifier_in(message));
  if (!played.empty()) return fault.played_problem(played);
  return std::string("the bus neither sends nor receives ") + (config_.playback ? "nor plays " : "") +
         "this message" + other_messages();
}

void CanDevice::add_fault(const std::string& message, std::unique_ptr<FrameFault> fault) {
  require(!started_ && fault_problem(message, *fault).empty(),
          "a fault fits its device, which is not started");
  if (const MessageLayout* const layout = layout_of(message))
    faults_.add(std::move(fault), *layout);
  else
    faults_.add(std::move(fault), *identifier_in(message));
}

}  // namespace hil::io::can
