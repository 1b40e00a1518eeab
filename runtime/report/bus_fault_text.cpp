#include "runtime/report/bus_fault_text.hpp"

#include <algorithm>

#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

class Sentences {
 public:
  /// Adds no sentence for a count of zero. `words` follow "3 frames".
  void add(std::uint64_t count, const char* one, const char* many, const std::string& words) {
    if (count > 0) all_.push_back(counted(count, one, many) + ' ' + words);
  }
  std::vector<std::string> take() { return std::move(all_); }

 private:
  std::vector<std::string> all_;
};

}  // namespace

std::vector<std::string> can_shortfalls(const CanBus& bus) {
  Sentences sentences;
  sentences.add(bus.saturated, "output value", "output values",
                "beyond the range of the signal: its limit was sent instead");
  sentences.add(bus.refused_values, "output value", "output values",
                "that were not a number: the last value was sent again");
  sentences.add(bus.dropped_releases, "tick", "ticks",
                "whose outputs were not sent: the bus's thread was too slow");
  sentences.add(bus.log_dropped, "frame", "frames", "missing in the log: the disk was too slow or failed");
  sentences.add(bus.send_errors, "frame", "frames",
                bus.send_fault.empty() ? "could not be sent while the bus was lost"
                                       : "could not be sent (the first: " + bus.send_fault + ")");
  return sentences.take();
}

std::vector<std::string> can_remarks(const CanBus& bus) {
  Sentences sentences;
  sentences.add(bus.fault_dropped_tx, "sent frame", "sent frames",
                "dropped by fault injection (drop, or delay beyond the end of the run): counted as sent, but "
                "neither on the bus nor in the log");
  sentences.add(
      bus.fault_dropped_rx, "frame of other stations", "frames of other stations",
      "dropped by fault injection (drop, or delay beyond the end of the run): neither received nor in "
      "the log");
  sentences.add(bus.fault_corrupted, "frame", "frames",
                "corrupted by fault injection: the log has them as they were on the bus");
  sentences.add(bus.fault_delayed, "frame", "frames",
                "delayed by fault injection: the log has the time on the bus");
  sentences.add(bus.wrong_kind, "received frame", "received frames",
                "refused: a remote request, or of another format (classic, CAN FD) than the message");
  for (const FrameLengths& lengths : bus.other_lengths) {
    sentences.add(lengths.longer, "received frame", "received frames",
                  "longer than the message " + lengths.message + ": the bytes after the message are padding");
    sentences.add(lengths.shorter, "received frame", "received frames",
                  "shorter than the message " + lengths.message +
                      ": only the signals that the frame contains completely were updated");
  }
  sentences.add(bus.lost_arrivals, "received value", "received values",
                "missing in the measured response times: more came in one tick than are kept");
  return sentences.take();
}

std::vector<std::string> unit_shortfalls(const ModbusUnit& unit) {
  const bool is_server = unit.role == "server";
  Sentences sentences;
  sentences.add(unit.timeouts, "request", "requests", "had no answer in time");
  std::uint64_t other_errors = unit.errors;
  for (const ExceptionCount& one : unit.exceptions) {
    other_errors -= std::min(other_errors, one.count);
    sentences.add(one.count, "request", "requests", "refused with exception " + std::to_string(one.code));
  }
  if (is_server) {
    sentences.add(other_errors, "connection", "connections", "closed for bytes that are not Modbus TCP");
  } else {
    sentences.add(other_errors, "request", "requests",
                  "with an invalid reply, or on a connection that was lost");
  }
  sentences.add(unit.reconnects, "time", "times", "connected again after the connection was lost");
  sentences.add(unit.saturated_outputs, "output value", "output values",
                "beyond the range of the register: its limit was written instead");
  sentences.add(unit.saturated_inputs, "input value", "input values",
                "beyond the range of the register: its limit was read instead");
  sentences.add(unit.not_a_number_outputs, "output value", "output values",
                "that were not a number: the register kept its value");
  sentences.add(unit.not_a_number_inputs, "input value", "input values",
                "that were not a finite number: the signal kept its value");
  sentences.add(
      unit.superseded, "tick", "ticks",
      "whose outputs were replaced by newer ones before they were sent: the unit or hil's thread was too "
      "slow");
  sentences.add(unit.stale, "time", "times", "an input became older than max_age and had its safe value");
  sentences.add(unit.refused_connections, "connection", "connections",
                "refused: max_clients was reached, or the system had no descriptor");
  sentences.add(unit.replaced_connections, "idle connection", "idle connections",
                "closed for another client (max_clients)");
  sentences.add(unit.dropped_connections, "connection", "connections",
                "dropped: the client was silent, or did not read its replies");
  return sentences.take();
}

}  // namespace hil::report
