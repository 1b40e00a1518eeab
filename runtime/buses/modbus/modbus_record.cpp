#include "runtime/buses/modbus/modbus_record.hpp"

#include <algorithm>
#include <utility>

namespace hil::buses::modbus {
namespace {

using contribution::add_repetition;
using contribution::add_sentence;
using contribution::BusSentence;

void copy_values(const io::modbus::ValueCounters& counters, UnitRecord& unit) {
  unit.saturated_outputs = counters.saturated_outputs;
  unit.out_of_range_inputs = counters.out_of_range_inputs;
  unit.not_a_number_outputs = counters.not_a_number_outputs;
  unit.not_a_number_inputs = counters.not_a_number_inputs;
}

/// `Counters`: those of a client or of a server.
template <typename Counters>
void copy_exceptions(const Counters& counters, const io::modbus::RegisterMap& map, UnitRecord& unit) {
  for (std::size_t code = 0; code < counters.by_code.size(); ++code) {
    if (counters.by_code[code] == 0) continue;
    const auto& first = counters.first_refused[code];
    unit.exceptions.push_back(
        {static_cast<int>(code), counters.by_code[code], first ? text_of(*first, map) : std::string()});
  }
}

std::string refusal_text(const ExceptionCount& exception) {
  const std::size_t code = static_cast<std::size_t>(exception.code);
  std::string text = "refused with exception " + std::to_string(exception.code) + " (" +
                     std::string(io::modbus::exception_name(code)) + ")";
  if (!exception.first_request.empty())
    text += exception.count > 1 ? ", first " + exception.first_request : ": " + exception.first_request;
  return text;
}

std::vector<BusSentence> faults_of(const UnitRecord& unit) {
  const bool is_server = unit.role == "server";
  std::vector<BusSentence> sentences;
  add_sentence(sentences, unit.timeouts, "request", "requests", "had no reply in time");
  std::uint64_t other_errors = unit.errors;
  for (const ExceptionCount& one : unit.exceptions) {
    other_errors -= std::min(other_errors, one.count);
    add_sentence(sentences, one.count, "request was", "requests were", refusal_text(one));
  }
  if (is_server) {
    add_sentence(sentences, other_errors, "connection was", "connections were",
                 "closed because the bytes were not Modbus TCP");
  } else {
    add_sentence(sentences, other_errors, "request", "requests",
                 "failed: the reply was invalid, or the connection was lost");
  }
  add_repetition(sentences, unit.reconnects, "the connection was lost and restored");
  add_sentence(sentences, unit.saturated_outputs, "output value was", "output values were",
               "beyond the range of the register: its limit was written instead");
  add_sentence(sentences, unit.out_of_range_inputs, "input value was", "input values were",
               "beyond the range of the register, and read as it is");
  add_sentence(sentences, unit.not_a_number_outputs, "output value was", "output values were",
               "not a number: the register kept its value");
  add_sentence(sentences, unit.not_a_number_inputs, "input value was", "input values were",
               "not a finite number: the signal kept its value");
  add_sentence(sentences, unit.superseded, "set of outputs was", "sets of outputs were",
               "not sent, because newer outputs came first: the unit or hil's thread was too slow");
  add_repetition(sentences, unit.stale, "an input became older than max_age and had its safe value");
  add_sentence(sentences, unit.refused_connections, "connection was", "connections were",
               "refused: max_clients was reached, or the system had no descriptor");
  add_sentence(sentences, unit.replaced_connections, "idle connection was", "idle connections were",
               "closed for another client (max_clients)");
  add_sentence(sentences, unit.dropped_connections, "connection was", "connections were",
               "dropped: the client was silent, or did not read its replies");
  return sentences;
}

}  // namespace

UnitRecord record_of(const io::modbus::ClientDevice& device) {
  const io::modbus::ClientCounters counters = device.counters();
  UnitRecord unit;
  unit.name = device.name();
  unit.role = "client";
  unit.requests = counters.requests;
  unit.replies = counters.replies;
  unit.timeouts = counters.timeouts;
  unit.errors = counters.errors;
  unit.reconnects = counters.reconnects;
  unit.superseded = counters.superseded_releases;
  unit.stale = counters.stale_inputs;
  copy_values(counters.values, unit);
  copy_exceptions(counters, device.map(), unit);
  return unit;
}

UnitRecord record_of(const io::modbus::ServerDevice& device) {
  const io::modbus::ServerCounters counters = device.counters();
  UnitRecord unit;
  unit.name = device.name();
  unit.role = "server";
  unit.requests = counters.requests;
  unit.replies = counters.replies;
  unit.errors = counters.exceptions + counters.malformed;
  unit.stale = device.stale_inputs();
  unit.connections = counters.accepted;
  unit.refused_connections = counters.refused;
  unit.replaced_connections = counters.replaced;
  unit.dropped_connections = counters.dropped_silent + counters.dropped_not_reading;
  copy_values(device.value_counters(), unit);
  copy_exceptions(counters, device.map(), unit);
  return unit;
}

std::vector<contribution::BusColumn> unit_columns() {
  return {{"unit", "Unit"},           {"requests", "Requests"},
          {"replies", "Replies"},     {"timeouts", "Time-outs", true},
          {"errors", "Errors", true}, {"reconnects", "Reconnects", true}};
}

contribution::BusRecord to_record(const UnitRecord& unit) {
  std::vector<contribution::BusRow> exceptions;
  for (const ExceptionCount& one : unit.exceptions) {
    exceptions.push_back({{"code", static_cast<std::uint64_t>(one.code)}, {"count", one.count}});
    if (!one.first_request.empty()) exceptions.back().emplace_back("first_request", one.first_request);
  }
  return {.name = unit.name,
          .fields = {{"role", unit.role},
                     {"requests", unit.requests},
                     {"replies", unit.replies},
                     {"timeouts", unit.timeouts},
                     {"errors", unit.errors},
                     {"reconnects", unit.reconnects},
                     {"exceptions", std::move(exceptions)},
                     {"saturated_outputs", unit.saturated_outputs},
                     {"out_of_range_inputs", unit.out_of_range_inputs},
                     {"not_a_number_outputs", unit.not_a_number_outputs},
                     {"not_a_number_inputs", unit.not_a_number_inputs},
                     {"superseded", unit.superseded},
                     {"stale", unit.stale},
                     {"connections", unit.connections},
                     {"refused_connections", unit.refused_connections},
                     {"replaced_connections", unit.replaced_connections},
                     {"dropped_connections", unit.dropped_connections}},
          .faults = faults_of(unit)};
}

}  // namespace hil::buses::modbus
