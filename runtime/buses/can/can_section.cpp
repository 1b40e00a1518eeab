#include "runtime/buses/can/can_section.hpp"

#include <algorithm>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

#include "runtime/buses/can/can_fault.hpp"
#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"

namespace hil::buses::can {
namespace {

using namespace config;

Schema sent_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("period", duration_schema(min_duration_s),
                          "The period of sending, a multiple of the bus's period. Left out: GenMsgCycleTime "
                          "of the DBC file, else one period of the bus."),
          Field::with_default(
              "offset", duration_schema(0.0), "0 ms",
              "The shift of sending: a multiple of the bus's period, less than the message's period."),
          Field::optional("counter", Schema::name(), "The signal that counts the frames."),
          Field::optional("checksum", Schema::name(),
                          "The signal that carries the checksum (CRC-8 SAE J1850)."),
          Field::with_default(
              "signals", Schema::map_of_checked_names(Schema::text()), "{}",
              "The source of each signal: a signal of the run, a number, or a value name of the DBC file. "
              "Other signals have their start value (GenSigStartValue), else their safe value."),
          Field::with_default("safe", Schema::map_of_checked_names(Schema::text()), "{}",
                              "The safe value of each signal, a number or a value name. Other signals: 0."),
      });
}

Schema received_schema() {
  return Schema::record_or(
      "message",
      {
          Field::needed("message", Schema::name(), "A message of the DBC file."),
          Field::optional("timeout", duration_schema(0.0),
                          "The age beyond which the signals are not fresh and have their safe values; a "
                          "multiplexed signal by its own last value. 0 ms: no limit. Left out: three times "
                          "GenMsgCycleTime of the DBC file, else no limit."),
          Field::optional("counter", Schema::name(),
                          "The signal that counts the frames. A frame after a gap is rejected."),
          Field::optional("checksum", Schema::name(),
                          "The signal that carries the checksum. A frame with a wrong one is rejected."),
          optional_field("the message"),
          Field::with_default(
              "max_rejected", Schema::integer(0, 1'000'000'000), "0",
              "How many of its frames may be rejected in a run that passes, without those that "
              "the scenario made (otherwise exit code 1)."),
          Field::with_default("safe", Schema::map_of_checked_names(Schema::text()), "{}",
                              "The safe value of each signal, a number or a value name. Other signals: 0."),
      });
}

Schema played_schema() {
  return Schema::record_or(
      "file",
      {
          Field::needed("file", Schema::file(), "A log in the form of candump -l."),
          Field::optional("interface", Schema::text(),
                          "The interface whose frames are played. Left out: the only one of the log."),
          Field::with_default("begin", duration_schema(0.0), "0 s",
                              "The run time of the first line of the log."),
          Field::with_default("repeat", Schema::integer(0, 1'000'000'000), "1",
                              "How many passes of the log are played; 0: to the end of the run."),
          Field::optional("every", duration_schema(min_duration_s),
                          "The time from the start of a pass to the next one. Left out: that from the first "
                          "line to the last frame."),
      });
}

Schema can_schema() {
  return Schema::record({
      Field::needed("bus", Schema::name(), "The bus's name. Its signals begin with can.NAME."),
      Field::with_default("device", Schema::text(), "virtual",
                          "virtual, or socketcan:INTERFACE for an interface of the kernel."),
      Field::needed("database", Schema::file(), "The DBC file."),
      Field::needed("rate", rate_schema(),
                    "The rate at which frames are read and sent. It divides the base rate."),
      Field::with_default("bit_rate", Schema::integer(1'000, 20'000'000), "500000",
                          "The bit rate in bits per second, for the bus load."),
      Field::with_default("units", Schema::map_of_checked_names(Schema::map_of_checked_names(Schema::text())),
                          "{}",
                          "Units of signals, by message and signal, where the DBC file has none or a wrong "
                          "one: {EgoStatus: {Speed: km/h}}."),
      Field::optional("priority", thread_priority_schema(),
                      "The real-time priority of the device's thread. Left out: an ordinary thread."),
      Field::with_default("send", Schema::list(sent_schema()), "[]", "The messages the run sends."),
      Field::with_default("receive", Schema::list(received_schema()), "[]", "The messages the run reads."),
      Field::optional("play", played_schema(),
                      "A log whose frames are sent at their recorded times, as those of other stations."),
      Field::optional("faults",
                      Schema::record({
                          Field::with_default("drop", Schema::number(0.0, 1.0), "0",
                                              "The probability that a frame is lost."),
                          Field::with_default("corrupt", Schema::number(0.0, 1.0), "0",
                                              "The probability that a bit of a frame is inverted."),
                          Field::with_default("delay", duration_schema(0.0, 60.0), "0 ms",
                                              "The delay of each frame. Under clock: virtual, rounded up to "
                                              "whole periods of the bus's rate."),
                      }),
                      "The faults that a virtual bus injects."),
      may_be_lost_field("The bus: its interface goes down or away, or its controller goes bus-off."),
  });
}

bool is_interface(std::string_view name) {
  constexpr std::size_t longest = 15;  // IFNAMSIZ with its closing zero
  const auto is_bad = [](char letter) { return letter == '/' || letter == ':' || letter <= ' '; };
  return !name.empty() && name.size() <= longest && std::none_of(name.begin(), name.end(), is_bad);
}

/// Empty for a virtual bus and for a mistake.
std::string read_interface(const Value& device, Diagnostics& diagnostics) {
  constexpr std::string_view prefix = "socketcan:";
  const std::string& text = device.text();
  if (text == "virtual") return {};
  if (!text.starts_with(prefix)) {
    const std::string meant = nearest(text, {"virtual"}).empty() ? "socketcan:" + text : "virtual";
    diagnostics.add(device.place(), "'device': " + in_quotes(text) +
                                        " is neither virtual nor socketcan:INTERFACE; did you mean " +
                                        in_quotes(meant) + "?");
    return {};
  }
  std::string interface = text.substr(prefix.size());
  if (!is_interface(interface)) {
    diagnostics.add(device.place(),
                    "'device': " + in_quotes(interface) +
                        " is not a name of an interface: 1 to 15 characters, as in socketcan:vcan0");
  }
  return interface;
}

/// A number, or a word that is looked up later. Empty with a mistake for a number that can not be read.
std::optional<std::variant<Word, double>> read_value(const Word& dbc_signal, const Value& value,
                                                     Diagnostics& diagnostics) {
  const std::string& text = value.text();
  const ParsedNumber number = read_number(text);
  if (number.length == 0 || (number.fault.empty() && number.length < text.size())) return word_of(value);
  if (number.fault.empty()) return number.value;
  diagnostics.add(value.place(), in_quotes(dbc_signal.text) + ": " + in_quotes(text) + " " + number.fault);
  return std::nullopt;
}

std::vector<SafeValue> read_safe(const Value& map, Diagnostics& diagnostics) {
  std::vector<SafeValue> values;
  for (std::size_t i = 0; i < map.entries().size(); ++i) {
    const Value& value = map.entries()[i].second;
    const Word dbc_signal{map.entries()[i].first, map.key_place(i)};
    if (const auto number = read_value(dbc_signal, value, diagnostics))
      values.push_back({dbc_signal, *number, value.place()});
  }
  return values;
}

std::optional<SignalSource> read_source(const Word& dbc_signal, const Value& value,
                                        Diagnostics& diagnostics) {
  auto read = read_value(dbc_signal, value, diagnostics);
  if (!read) return std::nullopt;
  return SignalSource{dbc_signal, std::move(*read), value.place()};
}

void read_period(const Value& value, SentMessage& sent, std::int64_t bus_period_ns,
                 Diagnostics& diagnostics) {
  if (value.has("period")) {
    if (!multiple_of(value["period"], bus_period_ns, "period", "the bus's period", diagnostics)) return;
    sent.period_ns = value["period"].duration_ns();
  }
  const Value& offset = value["offset"];
  if (!multiple_of(offset, bus_period_ns, "offset", "the bus's period", diagnostics)) return;
  sent.offset_ns = offset.duration_ns();
  sent.offset_place = offset.place();
  if (sent.period_ns == 0 || sent.offset_ns < sent.period_ns) return;
  diagnostics.add(offset.place(), "'offset': " + format_duration(sent.offset_ns) +
                                      " has to be less than the message's period of " +
                                      format_duration(sent.period_ns));
}

/// `bus_period_ns`: 0 when the rate is a mistake; periods are then not checked.
SentMessage read_sent(const Value& value, std::int64_t bus_period_ns, Diagnostics& diagnostics) {
  SentMessage sent;
  sent.message = word_of(value["message"]);
  if (bus_period_ns > 0) read_period(value, sent, bus_period_ns, diagnostics);
  sent.counter = word_in(value, "counter");
  sent.checksum = word_in(value, "checksum");
  const Value& signals = value["signals"];
  for (std::size_t i = 0; i < signals.entries().size(); ++i) {
    const auto& [name, source] = signals.entries()[i];
    const Word dbc_signal{name, signals.key_place(i)};
    if (sent.counter && sent.counter->text == name) {
      diagnostics.add(dbc_signal.place,
                      "hil writes " + in_quotes(name) + " (the counter); leave it out of 'signals'");
    } else if (sent.checksum && sent.checksum->text == name) {
      diagnostics.add(dbc_signal.place,
                      "hil writes " + in_quotes(name) + " (the checksum); leave it out of 'signals'");
    }
    std::optional<SignalSource> read = read_source(dbc_signal, source, diagnostics);
    if (read) sent.signals.push_back(std::move(*read));
  }
  sent.safe = read_safe(value["safe"], diagnostics);
  return sent;
}

ReceivedMessage read_received(const Value& value, Diagnostics& diagnostics) {
  ReceivedMessage received;
  received.message = word_of(value["message"]);
  if (value.has("timeout")) received.timeout_ns = value["timeout"].duration_ns();
  received.counter = word_in(value, "counter");
  received.checksum = word_in(value, "checksum");
  received.is_optional = value["optional"].boolean();
  received.max_rejected = static_cast<std::uint64_t>(value["max_rejected"].integer());
  received.safe = read_safe(value["safe"], diagnostics);
  return received;
}

void read_messages(const Value& value, CanSection& section, Diagnostics& diagnostics) {
  UniqueNames sent_names("sent message", diagnostics);
  UniqueNames received_names("received message", diagnostics);
  if (const Value* const list = part_of(value, "send")) {
    for (const Value& sent : list->items()) {
      if (const std::optional<Word> name = word_in(sent, "message")) sent_names.add(*name);
      if (is_whole(sent)) section.send.push_back(read_sent(sent, section.period_ns, diagnostics));
    }
  }
  if (const Value* const list = part_of(value, "receive")) {
    for (const Value& received : list->items()) {
      if (const std::optional<Word> name = word_in(received, "message")) received_names.add(*name);
      if (is_whole(received)) section.receive.push_back(read_received(received, diagnostics));
    }
  }
}

void read_units(const Value& value, CanSection& section, Diagnostics& diagnostics) {
  const Value* const messages = part_of(value, "units");
  if (messages == nullptr) return;
  for (std::size_t i = 0; i < messages->entries().size(); ++i) {
    const auto& [message, signals] = messages->entries()[i];
    for (std::size_t k = 0; k < signals.entries().size(); ++k) {
      const auto& [signal, unit] = signals.entries()[k];
      if (units::parse_unit(unit.text()))
        section.units.push_back(
            {{message, messages->key_place(i)}, {signal, signals.key_place(k)}, unit.text()});
      else
        diagnostics.add(unit.place(), in_quotes(unit.text()) + " is not a known unit");
    }
  }
}

void read_faults(const Value& value, CanSection& section, Diagnostics& diagnostics) {
  const Value* const faults = part_of(value, "faults");
  if (faults == nullptr) return;
  if (!section.is_virtual()) {
    diagnostics.add(faults->place(), "'faults': only a virtual bus can lose, delay and corrupt frames");
  }
  if (!is_whole(*faults)) return;
  section.faults = {(*faults)["drop"].number(), (*faults)["corrupt"].number(),
                    (*faults)["delay"].duration_ns()};
}

void read_play(const Value& value, CanSection& section, const ReaderContext& reading) {
  const Value* const play = part_of(value, "play");
  if (play == nullptr || !is_whole(*play)) return;
  PlayedLog log{.file = word_of((*play)["file"]),
                .interface = word_in(*play, "interface"),
                .begin_ns = (*play)["begin"].duration_ns(),
                .begin_place = (*play)["begin"].place(),
                .repeat = static_cast<std::uint64_t>((*play)["repeat"].integer()),
                .run_ns = reading.duration_ns,
                .send_interval_ns = reading.clock == ClockKind::virtual_time ? section.period_ns : 0};
  if (play->has("every")) {
    log.every_ns = (*play)["every"].duration_ns();
    log.every_place = (*play)["every"].place();
  }
  section.play = std::move(log);
}

/// Refuses two buses on one interface: each would take the other's frames for those of the device under test.
void check_interfaces(std::span<const std::shared_ptr<const BusSection>> list, ReaderContext& reading) {
  const std::vector<const CanSection*> sections = sections_of<CanSection>(list);
  for (std::size_t i = 0; i < sections.size(); ++i) {
    if (sections[i]->is_virtual()) continue;
    const auto end = sections.begin() + static_cast<std::ptrdiff_t>(i);
    const auto first = std::find_if(sections.begin(), end, [&](const CanSection* other) {
      return other->interface == sections[i]->interface;
    });
    if (first == end) continue;
    reading.diagnostics.add(sections[i]->device_place, "'device': the bus " + in_quotes((*first)->name.text) +
                                                           " is already on " +
                                                           in_quotes(sections[i]->interface));
  }
}

}  // namespace

void CanSection::read_entry(const Value& entry, ReaderContext& reading) {
  if (entry.has("device")) {
    interface = read_interface(entry["device"], reading.diagnostics);
    device_place = entry["device"].place();
    if (!is_virtual() && reading.clock == ClockKind::virtual_time) {
      reading.diagnostics.add(
          device_place,
          "'device': a SocketCAN bus runs in real time; 'clock: virtual' needs 'device: virtual'");
    }
  }
  read_messages(entry, *this, reading.diagnostics);
  read_units(entry, *this, reading.diagnostics);
  read_faults(entry, *this, reading.diagnostics);
  read_play(entry, *this, reading);
  if (!is_whole(entry)) return;
  database = entry["database"].text();
  bits_per_second = static_cast<double>(entry["bit_rate"].integer());
}

BusSectionType can_section_type() {
  return {.key = "can",
          .about = "The CAN buses.",
          .name_key = "bus",
          .noun = "CAN bus",
          .plural = "CAN buses",
          .input_noun = "message",
          .entry = can_schema(),
          .arrival_noun = "frame",
          .counts_dropped_releases = true,
          .faults = can_fault_kinds(),
          .create = []() -> std::unique_ptr<BusSection> { return std::make_unique<CanSection>(); },
          .check = check_interfaces};
}

}  // namespace hil::buses::can
