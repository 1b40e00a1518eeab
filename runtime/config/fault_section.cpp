#include "runtime/config/fault_section.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

#include "runtime/config/reading.hpp"
#include "runtime/config/shared_schemas.hpp"
#include "runtime/config/text_lists.hpp"

namespace hil::config {
namespace {

using FaultKind = FaultSection::Kind;
using FaultTarget = FaultSection::Target;

struct TargetWord {
  FaultTarget target;
  const char* key;
  const char* article;
  std::vector<std::string> effects;
};

const std::vector<TargetWord>& target_words() {
  static const std::vector<TargetWord> words{
      {FaultTarget::signal,
       "signal",
       "a signal",
       {"stuck", "offset", "gain", "noise", "drift", "delay", "dropout"}},
      {FaultTarget::message,
       "message",
       "a message",
       {"stuck", "drop", "repeat", "delay", "wrong", "length", "flip_bits"}},
      {FaultTarget::device, "device", "a device", {"state", "exception", "delay"}},
      {FaultTarget::process, "process", "a process", {"state"}},
      {FaultTarget::task, "task", "a task", {"takes_longer"}},
  };
  return words;
}

Schema fault_schema() {
  std::vector<Field> common{
      Field::needed("name", Schema::name(), "The fault's name. 'fault.NAME' is 1 while it is active."),
      Field::optional("signal", Schema::signal(), "The signal that readers read wrongly."),
      Field::optional(
          "message", Schema::text(),
          "A message that a CAN bus sends, receives or plays: 'can.car.BrakeCommand', or by its identifier "
          "'can.car.0x123' of 11 bits; one of more than three digits has 29 bits."),
      Field::optional("device", Schema::signal(), "A bus or a Modbus unit: 'can.car', 'modbus.plc'."),
      Field::optional("process", Schema::name(), "A process that the run starts."),
      Field::optional("task", Schema::name(), "The task of a module."),
      Field::with_default("readers", Schema::list(Schema::signal()), "[]",
                          "Of a signal: modules, buses ('can.car') or their inputs ('control.level'). Left "
                          "out: all modules and buses that read the signal."),
  };
  add_activation_fields(common);
  return Schema::exactly_one(
      {
          Field::optional("stuck", Schema::text(),
                          "Of a signal: an expression, or 'last': the value before the fault. Of a message: "
                          "'last', the payload before the fault; counter and checksum go on."),
          Field::optional("offset", Schema::text(), "Of a signal: an expression that is added."),
          Field::optional("gain", Schema::text(), "Of a signal: a factor."),
          Field::optional("noise", Schema::text(),
                          "Of a signal: the standard deviation of normally distributed noise that is added, "
                          "from the run's seed."),
          Field::optional("drift", Schema::text(),
                          "Of a signal: a change per second since the begin, which is added."),
          Field::optional("dropout", Schema::quantity(Quantity::share, 0.0, 1.0),
                          "Of a signal: the share of ticks in which there is no value, from the run's seed."),
          Field::optional("delay", duration_schema(min_duration_s, max_fault_delay_s),
                          "How late a signal is (a multiple of the base period), a frame of a message, or a "
                          "reply of a Modbus unit."),
          Field::optional("drop", Schema::quantity(Quantity::share, 0.0, 1.0),
                          "Of a message: the share of its frames that is lost, from the run's seed."),
          Field::optional("repeat", Schema::integer(1, 100),
                          "Of a message: how many more times each frame comes."),
          Field::optional("wrong", Schema::one_of({"counter", "checksum"}),
                          "Of a message: its counter keeps its last value, with the right checksum; or all "
                          "bits of its checksum are inverted."),
          Field::optional("length", Schema::integer(0, 64),
                          "Of a message: the bytes of its frames; further ones are zero."),
          Field::optional("flip_bits", Schema::list(Schema::integer(0, 511), 1, 512),
                          "Of a message: the bits of its payload that are inverted, as 8 * byte + bit; a "
                          "checksum is not corrected."),
          Field::optional("state", Schema::one_of({"bus_off", "silent", "disconnected", "paused", "killed"}),
                          "Of a CAN bus: bus_off. Of a Modbus unit: silent (no request is answered) or "
                          "disconnected. Of a process: paused or killed."),
          Field::optional("exception", Schema::integer(1, 11),
                          "Of a Modbus unit: the exception with which each request is answered."),
          Field::optional("takes_longer", duration_schema(min_duration_s),
                          "Of a task: how much longer each step takes."),
      },
      std::move(common));
}

const char* article_of(FaultTarget target) {
  for (const TargetWord& word : target_words()) {
    if (word.target == target) return word.article;
  }
  return "";
}

/// Empty with mistakes.
const TargetWord* target_of(const Value& section, Diagnostics& diagnostics) {
  const TargetWord* found = nullptr;
  for (const TargetWord& word : target_words()) {
    if (!section.has(word.key)) continue;
    if (found != nullptr) {
      diagnostics.add(section[word.key].place(),
                      std::string("'") + found->key + "' and '" + word.key + "' exclude each other");
      return nullptr;
    }
    found = &word;
  }
  if (found == nullptr) {
    diagnostics.add(section.place(),
                    "a fault needs its target: 'signal', 'message', 'device', 'process' or 'task'");
    return nullptr;
  }
  const std::string& effect = section.chosen();
  if (std::ranges::find(found->effects, effect) != found->effects.end()) return found;
  diagnostics.add(section[effect].place(), std::string(found->article) + " has no fault '" + effect +
                                               "'; it has " + text_list(found->effects));
  return nullptr;
}

FaultKind state_of(const Value& state) {
  static const std::map<std::string, FaultKind> kinds{{"bus_off", FaultKind::bus_off},
                                                      {"silent", FaultKind::silent},
                                                      {"disconnected", FaultKind::disconnected},
                                                      {"paused", FaultKind::paused},
                                                      {"killed", FaultKind::killed}};
  return kinds.at(state.text());
}

void read_state(const Value& state, FaultSection& fault, Diagnostics& diagnostics) {
  fault.kind = state_of(state);
  const bool is_of_process = fault.kind == FaultKind::paused || fault.kind == FaultKind::killed;
  if (is_of_process != (fault.target == FaultTarget::process)) {
    diagnostics.add(state.place(), std::string(article_of(fault.target)) + " can not be " + state.text() +
                                       (is_of_process ? "; a process can" : "; it can be paused or killed"));
  }
  if (fault.kind == FaultKind::killed &&
      (fault.activation.for_ns || fault.activation.until || fault.activation.active_while)) {
    diagnostics.add(state.place(), "a killed process does not come back, so its fault has no end");
  }
}

void read_effect(const Value& section, FaultSection& fault, ReaderContext& reading) {
  static const std::map<std::string, FaultKind> values{{"stuck", FaultKind::stuck},
                                                       {"offset", FaultKind::offset},
                                                       {"gain", FaultKind::gain},
                                                       {"noise", FaultKind::noise},
                                                       {"drift", FaultKind::drift}};
  const std::string& effect = section.chosen();
  const Value& given = section[effect];
  fault.place = given.place();
  if (const auto value = values.find(effect); value != values.end()) {
    fault.kind = value->second;
    if (fault.kind == FaultKind::stuck && given.text() == "last")
      fault.kind = FaultKind::stuck_at_last;
    else if (fault.target == FaultTarget::message)
      reading.diagnostics.add(given.place(), "'stuck' of a message can only be 'last'");
    else
      fault.value = Expression::parse(given, reading.diagnostics);
  } else if (effect == "delay" || effect == "takes_longer") {
    fault.kind = effect == "delay" ? FaultKind::delay : FaultKind::takes_longer;
    fault.duration_ns = given.duration_ns();
    if (fault.target == FaultTarget::signal && reading.base)
      multiple_of(given, reading.base->period_ns, effect, "the base period", reading.diagnostics);
  } else if (effect == "dropout" || effect == "drop") {
    fault.kind = effect == "drop" ? FaultKind::drop : FaultKind::dropout;
    fault.share = given.number();
    if (fault.share == 0.0)
      reading.diagnostics.add(given.place(),
                              "'" + effect + "': 0 % changes nothing; a fault has a share above 0 %");
  } else if (effect == "wrong") {
    fault.kind = given.text() == "counter" ? FaultKind::wrong_counter : FaultKind::wrong_checksum;
  } else if (effect == "flip_bits") {
    fault.kind = FaultKind::flip_bits;
    for (const Value& bit : given.items()) {
      const auto number = static_cast<std::uint32_t>(bit.integer());
      if (std::ranges::find(fault.bits, number) != fault.bits.end())
        reading.diagnostics.add(bit.place(),
                                "'flip_bits': bit " + std::to_string(number) + " is listed twice");
      fault.bits.push_back(number);
    }
  } else if (effect == "state") {
    read_state(given, fault, reading.diagnostics);
  } else {
    fault.kind = effect == "repeat"   ? FaultKind::repeat
                 : effect == "length" ? FaultKind::length
                                      : FaultKind::exception;
    fault.number = static_cast<std::uint32_t>(given.integer());
  }
}

}  // namespace

std::string FaultSection::effect() const {
  switch (kind) {
    case FaultKind::stuck_at_last:
      return target == FaultTarget::message ? "stuck at its last payload" : "stuck at its last value";
    case FaultKind::stuck:
      return "stuck at " + value->text();
    case FaultKind::offset:
      return "offset by " + value->text();
    case FaultKind::gain:
      return "multiplied by " + value->text();
    case FaultKind::noise:
      return "noise of " + value->text();
    case FaultKind::drift:
      return "drift of " + value->text();
    case FaultKind::delay:
      return (target == FaultTarget::device ? "with replies delayed by " : "delayed by ") +
             format_duration(duration_ns);
    case FaultKind::dropout:
      return "without value in " + format_number(100.0 * share) + " % of the ticks";
    case FaultKind::drop:
      return "without " + format_number(100.0 * share) + " % of its frames";
    case FaultKind::repeat:
      return "with each frame " + std::to_string(number) + (number == 1 ? " more time" : " more times");
    case FaultKind::wrong_counter:
      return "with a counter that stands still";
    case FaultKind::wrong_checksum:
      return "with a wrong checksum";
    case FaultKind::length:
      return "with frames of " + std::to_string(number) + " bytes";
    case FaultKind::flip_bits: {
      std::vector<std::string> numbers;
      for (const std::uint32_t bit : bits)
        numbers.push_back(std::to_string(bit));
      return (numbers.size() == 1 ? "with inverted bit " : "with inverted bits ") + text_list(numbers);
    }
    case FaultKind::bus_off:
      return "bus-off";
    case FaultKind::silent:
      return "without replies";
    case FaultKind::disconnected:
      return "disconnected";
    case FaultKind::exception:
      return "with replies of exception " + std::to_string(number);
    case FaultKind::paused:
      return "paused";
    case FaultKind::killed:
      return "killed";
    case FaultKind::takes_longer:
      return "with steps that take " + format_duration(duration_ns) + " longer";
  }
  return {};
}

Schema faults_schema() {
  return Schema::list(fault_schema());
}

void read_faults(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const list = part_of(root, "faults");
  if (list == nullptr) return;
  UniqueNames names("fault", reading.diagnostics);
  for (const Value& section : list->items()) {
    if (const std::optional<Word> name = word_in(section, "name")) names.add(*name);
    if (!is_whole(section)) continue;
    const std::size_t before = reading.diagnostics.count();
    FaultSection fault{.name = word_of(section["name"])};
    read_activation(section, fault.activation, scenario, reading.diagnostics);
    if (const TargetWord* const target = target_of(section, reading.diagnostics)) {
      fault.target = target->target;
      fault.subject = word_of(section[target->key]);
      read_effect(section, fault, reading);
    }
    for (const Value& reader : section["readers"].items())
      fault.readers.push_back(word_of(reader));
    if (!fault.readers.empty() && fault.target != FaultTarget::signal)
      reading.diagnostics.add(section["readers"].place(), "'readers' belongs to the fault of a signal");
    if (reading.diagnostics.count() == before) scenario.faults.push_back(std::move(fault));
  }
}

}  // namespace hil::config
