#include "runtime/buses/can/can_description.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <variant>
#include <vector>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

#include "io/can/signal_codec.hpp"
#include "runtime/buses/can/played_log.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::buses::can {
namespace {

using config::Diagnostics;

std::optional<io::can::Dbc> load_database(const CanSection& section, Diagnostics& diagnostics) {
  io::can::DbcResult loaded = io::can::load_dbc(section.database);
  for (const io::can::DbcProblem& problem : loaded.problems) {
    if (problem.severity == io::can::DbcProblem::Severity::unusable) continue;
    const config::Place place{section.database, static_cast<std::uint32_t>(problem.line),
                              static_cast<std::uint32_t>(problem.column)};
    if (loaded.is_usable()) {
      diagnostics.warn(place, problem.text);
    } else {
      diagnostics.add(place, problem.text);
    }
  }
  if (!loaded.is_usable()) return std::nullopt;
  return std::move(loaded.database);
}

/// Null with a mistake when there is no such message.
const io::can::DbcMessage* message_named(const io::can::Dbc& database, const Word& word,
                                         Diagnostics& diagnostics) {
  const io::can::DbcMessage* const found = database.find_message(word.text);
  if (found != nullptr) return found;
  std::vector<std::string> names;
  for (const io::can::DbcMessage& known : database.messages)
    names.push_back(known.name);
  diagnostics.add(word.place, "the CAN database has no message '" + word.text + "'" +
                                  config::suggestion(word.text, names));
  return nullptr;
}

/// The same; null with a mistake also when it can not be sent or received.
const io::can::DbcMessage* find_message(const io::can::Dbc& database, const Word& word, io::can::Use use,
                                        Diagnostics& diagnostics) {
  const io::can::DbcMessage* const found = message_named(database, word, diagnostics);
  if (found == nullptr) return nullptr;
  const std::vector<std::string> problems = io::can::coding_problems(*found, {}, use);
  for (const std::string& problem : problems)
    diagnostics.add(word.place, problem);
  return problems.empty() ? found : nullptr;
}

/// Null with a mistake when the message has no such signal.
const io::can::DbcSignal* find_dbc_signal(const io::can::DbcMessage& message, const Word& signal,
                                          Diagnostics& diagnostics) {
  const io::can::DbcSignal* const found = message.find_signal(signal.text);
  if (found != nullptr) return found;
  std::vector<std::string> names;
  for (const io::can::DbcSignal& known : message.signals)
    names.push_back(known.name);
  diagnostics.add(signal.place, "message " + message.name + " has no signal '" + signal.text + "'" +
                                    config::suggestion(signal.text, names));
  return nullptr;
}

/// Gives signals of the database the units of the scenario.
void set_units(const std::vector<SignalUnit>& units, io::can::Dbc& database, Diagnostics& diagnostics) {
  for (const SignalUnit& unit : units) {
    const io::can::DbcMessage* const message = message_named(database, unit.message, diagnostics);
    const io::can::DbcSignal* const signal =
        message == nullptr ? nullptr : find_dbc_signal(*message, unit.dbc_signal, diagnostics);
    if (signal == nullptr) continue;
    io::can::DbcMessage& changed =
        database.messages[static_cast<std::size_t>(message - database.messages.data())];
    changed.signals[static_cast<std::size_t>(signal - message->signals.data())].unit = unit.unit;
  }
}

/// Adds a mistake for a constant at `place` beyond the bits or the range of the signal, which the scenario
/// calls `written`.
void check_constant(const io::can::DbcSignal& signal, const std::string& written, double value,
                    const config::Place& place, Diagnostics& diagnostics) {
  const io::can::SignalCodec codec(signal);
  if (codec.to_raw(value).verdict != io::can::SignalCodec::Verdict::saturated) return;
  diagnostics.add(place, "'" + written + "': " + config::format_number(value) +
                             " is out of range; the signal has the range " +
                             config::format_number(codec.physical_minimum()) + " to " +
                             config::format_number(codec.physical_maximum()));
}

/// Leaves `protection` empty after a mistake; the message can still be used.
template <class Section>
void take_protection(const Section& section, const io::can::DbcMessage& message, io::can::Use use,
                     io::can::Protection& protection, Diagnostics& diagnostics) {
  const auto name_of = [&](const std::optional<Word>& word) -> std::string {
    const io::can::DbcSignal* const signal = word ? find_dbc_signal(message, *word, diagnostics) : nullptr;
    return signal == nullptr ? std::string() : signal->name;
  };
  io::can::Protection wanted;
  const std::size_t before = diagnostics.count();
  const auto check = [&](const std::optional<Word>& word, std::string& signal) {
    if (!word) return;
    signal = name_of(word);
    if (diagnostics.count() != before) return;
    for (const std::string& problem : io::can::coding_problems(message, wanted, use))
      diagnostics.add(word->place, problem);
  };
  check(section.counter, wanted.counter_signal);
  check(section.checksum, wanted.checksum_signal);
  if (diagnostics.count() == before) protection = wanted;
}

template <class Configured>
bool is_named_twice(const Word& word, const io::can::DbcMessage& message,
                    const std::vector<Configured>& configured, Diagnostics& diagnostics) {
  if (std::ranges::find(configured, message.name, &Configured::message) == configured.end()) return false;
  diagnostics.add(word.place, "message '" + word.text + "' is named twice");
  return true;
}

std::map<std::string, double> safe_values_of(const std::vector<SafeValue>& written,
                                             const io::can::DbcMessage& message, bool is_sent,
                                             Diagnostics& diagnostics) {
  std::map<std::string, double> values;
  for (const SafeValue& safe : written) {
    const io::can::DbcSignal* const signal = find_dbc_signal(message, safe.dbc_signal, diagnostics);
    if (signal == nullptr) continue;
    std::optional<double> value;
    if (const Word* const name = std::get_if<Word>(&safe.value)) {
      value = signals::value_named(named_values_of(*signal), *name, message.name + "." + signal->name,
                                   diagnostics);
    } else {
      value = std::get<double>(safe.value);
    }
    if (!value) continue;
    if (is_sent) check_constant(*signal, safe.dbc_signal.text, *value, safe.value_place, diagnostics);
    values[signal->name] = *value;
  }
  return values;
}

/// The written period, the cycle time of the DBC file, or the period of the bus.
std::int64_t period_of(const SentMessage& sent, const io::can::DbcMessage& message,
                       std::int64_t bus_period_ns, Diagnostics& diagnostics) {
  if (sent.period_ns > 0) return sent.period_ns;
  const std::int64_t cycle_ns = message.cycle_time_ms * 1'000'000;
  const std::int64_t period_ns = cycle_ns > 0 ? cycle_ns : bus_period_ns;
  const std::string source = cycle_ns > 0 ? " (its cycle time in the DBC file)" : " (that of the bus)";
  if (period_ns % bus_period_ns != 0) {
    diagnostics.add(sent.message.place,
                    "the period of '" + message.name + "', " + config::format_duration(period_ns) + source +
                        ", is no multiple of the bus's period of " + config::format_duration(bus_period_ns) +
                        "; set 'period' or another 'rate'");
  } else if (sent.offset_ns >= period_ns) {
    diagnostics.add(sent.offset_place, "'offset': " + config::format_duration(sent.offset_ns) +
                                           " has to be less than the message's period of " +
                                           config::format_duration(period_ns) + source);
  }
  return period_ns;
}

void describe_sent(const SentMessage& sent, std::int64_t bus_period_ns, io::can::CanDeviceConfig& device,
                   Diagnostics& diagnostics) {
  const io::can::DbcMessage* const message =
      find_message(device.database, sent.message, io::can::Use::send, diagnostics);
  if (message == nullptr || is_named_twice(sent.message, *message, device.send, diagnostics)) return;
  io::can::SentMessageConfig config{.message = message->name,
                                    .period_ns = period_of(sent, *message, bus_period_ns, diagnostics),
                                    .offset_ns = sent.offset_ns,
                                    .protection = {},
                                    .safe_values = safe_values_of(sent.safe, *message, true, diagnostics)};
  take_protection(sent, *message, io::can::Use::send, config.protection, diagnostics);
  std::vector<const io::can::DbcSignal*> fed;
  for (const SignalSource& source : sent.signals) {
    const io::can::DbcSignal* const signal = find_dbc_signal(*message, source.dbc_signal, diagnostics);
    if (signal == nullptr) continue;
    if (std::find(fed.begin(), fed.end(), signal) != fed.end())
      diagnostics.add(source.dbc_signal.place,
                      "'" + signal->name + "' is set twice, by its long and its short name");
    fed.push_back(signal);
    if (const double* constant = std::get_if<double>(&source.source))
      check_constant(*signal, source.dbc_signal.text, *constant, source.source_place, diagnostics);
  }
  device.send.push_back(std::move(config));
}

void describe_received(const ReceivedMessage& received, io::can::CanDeviceConfig& device,
                       Diagnostics& diagnostics) {
  const io::can::DbcMessage* const message =
      find_message(device.database, received.message, io::can::Use::receive, diagnostics);
  if (message == nullptr || is_named_twice(received.message, *message, device.receive, diagnostics)) return;
  if (std::ranges::find(device.send, message->name, &io::can::SentMessageConfig::message) !=
      device.send.end()) {
    diagnostics.add(received.message.place, "message '" + received.message.text +
                                                "' is under 'receive' and under 'send'; hil either sends a "
                                                "message or receives it: leave it out of one of them");
    return;
  }
  constexpr std::int64_t cycles = 3;
  io::can::ReceivedMessageConfig config{
      .message = message->name,
      .timeout_ns = received.timeout_ns.value_or(cycles * message->cycle_time_ms * 1'000'000),
      .protection = {},
      .safe_values = safe_values_of(received.safe, *message, false, diagnostics)};
  take_protection(received, *message, io::can::Use::receive, config.protection, diagnostics);
  device.receive.push_back(std::move(config));
}

}  // namespace

std::optional<io::can::CanDeviceConfig> describe_can_device(const CanSection& section,
                                                            Diagnostics& diagnostics) {
  auto database = load_database(section, diagnostics);
  if (!database) return std::nullopt;
  set_units(section.units, *database, diagnostics);
  io::can::CanDeviceConfig device;
  device.name = section.name.text;
  device.bits_per_second = section.bits_per_second;
  device.may_be_lost = section.may_be_lost;
  device.database = std::move(*database);
  for (const SentMessage& sent : section.send)
    describe_sent(sent, section.period_ns, device, diagnostics);
  for (const ReceivedMessage& received : section.receive)
    describe_received(received, device, diagnostics);
  if (section.play) {
    const auto can_id = [](const io::can::DbcMessage& message) {
      return message.id | (message.is_extended ? CAN_EFF_FLAG : 0U);
    };
    BusIdentifiers ids;
    for (const io::can::SentMessageConfig& sent : device.send)
      ids.sent.insert(can_id(*device.database.find_message(sent.message)));
    for (const io::can::DbcMessage& message : device.database.messages)
      ids.known.insert(can_id(message));
    device.playback = read_played_log(*section.play, ids, diagnostics);
  }
  const std::vector<std::string> problems = io::can::configuration_problems(device);
  for (const std::string& problem : problems)
    diagnostics.add(section.name.place, problem);
  if (!problems.empty()) return std::nullopt;
  return device;
}

std::map<std::string, double> named_values_of(const io::can::DbcSignal& signal) {
  std::map<std::string, double> values;
  for (const auto& [raw, name] : signal.value_names) {
    const std::optional<double> number = io::can::raw_number(signal, static_cast<double>(raw));
    if (!number) continue;
    const double value = io::can::physical_of(signal, *number);
    const auto [there, is_new] = values.emplace(name, value);
    if (!is_new && there->second != value) there->second = std::numeric_limits<double>::quiet_NaN();
  }
  return values;
}

std::optional<double> start_value_of(const io::can::DbcSignal& signal) {
  if (!signal.start_raw) return std::nullopt;
  const std::optional<double> number = io::can::raw_number(signal, *signal.start_raw);
  if (!number) return std::nullopt;
  return io::can::physical_of(signal, *number);
}

void warn_of_unset_signals(const SentMessage& sent, const io::can::DbcMessage& message,
                           const std::function<bool(const std::string&)>& is_driven,
                           Diagnostics& diagnostics) {
  std::string unset, unfit, by_default;
  for (const io::can::DbcSignal& signal : message.signals) {
    const auto is_this = [&](const std::string& name) { return message.find_signal(name) == &signal; };
    const bool fills_itself =
        (sent.counter && is_this(sent.counter->text)) || (sent.checksum && is_this(sent.checksum->text));
    const bool is_set = std::any_of(sent.signals.begin(), sent.signals.end(),
                                    [&](const auto& source) { return is_this(source.dbc_signal.text); });
    const bool has_start = start_value_of(signal).has_value();
    if (fills_itself || is_set || is_driven(signal.name) || (has_start && !signal.start_is_default)) continue;
    std::string& list = has_start ? by_default : signal.start_raw ? unfit : unset;
    list += (list.empty() ? "'" : ", '") + signal.name + "'";
    if (signal.start_raw) list += " (" + config::format_number(*signal.start_raw) + ")";
  }
  if (!by_default.empty()) {
    diagnostics.warn(sent.message.place, "nothing sets these signals of " + message.name +
                                             "; they have the start value that the DBC file gives to all "
                                             "signals (BA_DEF_DEF_ GenSigStartValue): " +
                                             by_default);
  }
  if (!unfit.empty()) {
    diagnostics.warn(sent.message.place,
                     "nothing sets these signals of " + message.name +
                         ", and their start values in the DBC file (GenSigStartValue, which is raw) do not "
                         "fit their bits; they have their safe values: " +
                         unfit);
  }
  if (unset.empty()) return;
  diagnostics.warn(sent.message.place,
                   "nothing sets these signals of " + message.name +
                       ", and the DBC file gives them no start value; they have their safe "
                       "values: " +
                       unset);
}

std::string precision_warning(const io::can::DbcSignal& signal) {
  if (!signal.is_wide_integer()) return {};
  return "has " + std::to_string(signal.length_bits) +
         " bits; a signal is a double, which rounds integers beyond 2^53 (9007199254740992)";
}

}  // namespace hil::buses::can
