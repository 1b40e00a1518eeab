#include "runtime/buses/can/can_wiring.hpp"

#include <algorithm>
#include <string_view>
#include <utility>

#include "io/can/socketcan_bus.hpp"
#include "runtime/buses/can/can_bus_device.hpp"
#include "runtime/buses/can/can_description.hpp"
#include "runtime/buses/can/can_fault.hpp"
#include "runtime/config/text_lists.hpp"

namespace hil::buses::can {
namespace {

using config::Diagnostics;

template <class Configured>
const io::can::DbcMessage* used(const io::can::Dbc& database, const Word& name,
                                const std::vector<Configured>& configured) {
  const io::can::DbcMessage* const message = database.find_message(name.text);
  const bool is_used = message != nullptr &&
                       std::ranges::find(configured, message->name, &Configured::message) != configured.end();
  return is_used ? message : nullptr;
}

/// Connects an output to a value name of its DBC signal or to a signal of the run; a name without a dot is
/// first a value name.
void connect_output(const Word& word, const io::can::DbcSignal& signal, const io::ChannelInfo& channel,
                    Source& target, const KnownSignals& known, Diagnostics& diagnostics) {
  const std::map<std::string, double> values = named_values_of(signal);
  constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.";
  const bool has_dot =
      word.text.find('.') != std::string::npos && word.text.find_first_not_of(letters) == std::string::npos;
  const bool is_signal = known.table().find(word.text).has_value();
  const bool may_be_signal = has_dot || is_signal || word.text.ends_with(')');
  if (!may_be_signal || (values.contains(word.text) && !(has_dot && is_signal))) {
    if (const auto value = signals::value_named(values, word, channel.name, diagnostics))
      target.constant = *value;
    return;
  }
  target.signal = known.find(word, diagnostics);
  target.conversion =
      known.conversion_for(target.signal, channel.name, channel.unit, word.place, diagnostics);
}

}  // namespace

CanWiring::CanWiring(const CanSection& section, io::can::CanDeviceConfig config)
    : section_(section),
      config_(std::move(config)),
      channels_(std::make_unique<io::can::CanDevice>(
          config_, std::make_unique<io::can::SocketCanBus>(
                       io::can::SocketCanConfig{.interface = section.name.text}))) {}

const io::can::DbcMessage* CanWiring::sent(const Word& name) const {
  return used(config_.database, name, config_.send);
}

const io::can::DbcMessage* CanWiring::received(const Word& name) const {
  return used(config_.database, name, config_.receive);
}

void CanWiring::describe_message(const Word& name, const io::can::DbcMessage* message,
                                 const std::string& prefix, KnownSignals& known) const {
  if (message == nullptr) {
    // The name of the message is a mistake here; a signal of the bus elsewhere may be right.
    const bool is_known = config_.database.find_message(name.text) != nullptr;
    return known.add_undeclared(is_known ? prefix + name.text + "." : prefix);
  }
  for (const io::can::DbcSignal& signal : message->signals) {
    const auto id = known.table().find(prefix + message->name + "." + signal.name);
    if (!id) continue;
    for (const std::string& first : {message->name, message->short_name}) {
      for (const std::string& second : {signal.name, signal.short_name}) {
        std::string alias = prefix;
        alias.append(first).append(".").append(second);
        known.table().add_alias(alias, *id);
      }
    }
    known.table().set_named_values(*id, named_values_of(signal));
    if (std::string warning = precision_warning(signal); !warning.empty())
      known.set_imprecise(*id, std::move(warning));
  }
}

void CanWiring::describe_signals(const std::string& prefix, KnownSignals& known) const {
  for (const SentMessage& message : section_.send)
    describe_message(message.message, sent(message.message), prefix, known);
  for (const ReceivedMessage& configured : section_.receive) {
    const io::can::DbcMessage* const message = received(configured.message);
    describe_message(configured.message, message, prefix, known);
    if (message == nullptr || configured.timeout_ns) continue;
    for (const io::can::DbcSignal& signal : message->signals) {
      const auto id = known.table().find(prefix + message->name + "." + signal.name);
      if (id && known.table().info(*id).timeout_ns == 0) known.set_never_stale(*id);
    }
  }
}

InputRule CanWiring::input_rule(std::size_t group) const {
  const io::can::DbcMessage& message = *config_.database.find_message(channels_->input_groups()[group].name);
  const auto section = std::ranges::find_if(
      section_.receive, [&](const ReceivedMessage& entry) { return received(entry.message) == &message; });
  const auto is_of_message = [&](const io::can::PlayedFrame& frame) {
    return (frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK)) ==
           (message.id | (message.is_extended ? CAN_EFF_FLAG : 0U));
  };
  const bool is_played = config_.playback && std::ranges::any_of(*config_.playback->frames, is_of_message);
  return {.has_to_come = !section->is_optional && !is_played, .max_rejected = section->max_rejected};
}

void CanWiring::connect_message(const SentMessage& sent, const io::can::DbcMessage& message,
                                const KnownSignals& known, std::vector<Source>& outputs,
                                Diagnostics& diagnostics) const {
  for (const io::can::DbcSignal& signal : message.signals) {
    const std::size_t index = io::output_index(*channels_, message.name + "." + signal.name);
    const auto start = start_value_of(signal);
    if (index < outputs.size() && start) outputs[index].constant = *start;
  }
  const auto is_driven = [&](const std::string& signal) {  // by a stimulus
    return known.table().find(section_.full_name() + "." + message.name + "." + signal).has_value();
  };
  warn_of_unset_signals(sent, message, is_driven, diagnostics);
  for (const SignalSource& source : sent.signals) {
    const io::can::DbcSignal* const found = message.find_signal(source.dbc_signal.text);
    if (found == nullptr) continue;
    const io::can::DbcSignal& signal = *found;
    const std::size_t index = io::output_index(*channels_, message.name + "." + signal.name);
    if (index == outputs.size()) {
      diagnostics.add(source.dbc_signal.place, "hil writes '" + source.dbc_signal.text +
                                                   "' (the counter or checksum of " + sent.message.text +
                                                   "); leave it out of 'signals'");
      continue;
    }
    const std::string imprecise = precision_warning(signal);
    if (!imprecise.empty())
      diagnostics.warn(source.dbc_signal.place, "'" + source.dbc_signal.text + "' " + imprecise);
    if (const double* constant = std::get_if<double>(&source.source)) {
      outputs[index].constant = *constant;
    } else {
      connect_output(std::get<Word>(source.source), signal, channels_->outputs()[index], outputs[index],
                     known, diagnostics);
    }
  }
}

void CanWiring::connect(const KnownSignals& known, std::vector<Source>& outputs,
                        Diagnostics& diagnostics) const {
  for (const SentMessage& message : section_.send) {
    if (const io::can::DbcMessage* const used_message = sent(message.message))
      connect_message(message, *used_message, known, outputs, diagnostics);
  }
}

std::string CanWiring::fault_problem(const InjectedFault& fault) const {
  if (const auto* const effect = dynamic_cast<const CanFault*>(fault.effect.get()))
    return effect->problem(*channels_, fault.message);
  if (!fault.message.empty()) return "a message of CAN has no such fault";
  std::vector<std::string> words;
  for (const config::FaultKind& kind : can_fault_kinds())
    if (kind.target == config::FaultTarget::device) words.push_back(kind.word);
  return "a CAN bus can only be " + config::text_list(words, "or");
}

std::unique_ptr<BusDevice> CanWiring::make_device(RunEnvironment environment) const {
  return std::make_unique<CanBusDevice>(section_, config_, std::move(environment));
}

}  // namespace hil::buses::can
