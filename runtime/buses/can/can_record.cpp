#include "runtime/buses/can/can_record.hpp"

#include <utility>

namespace hil::buses::can {
namespace {

using contribution::add_sentence;
using contribution::BusSentence;

std::vector<BusSentence> faults_of(const CanRecord& bus) {
  std::vector<BusSentence> sentences;
  add_sentence(sentences, bus.saturated, "output value was", "output values were",
               "beyond the range of the signal: its limit was sent instead");
  add_sentence(sentences, bus.refused_values, "output value was", "output values were",
               "not a number: the last value was sent again");
  add_sentence(sentences, bus.dropped_releases, "set of outputs was", "sets of outputs were",
               "not sent: the thread of the bus was too slow");
  add_sentence(sentences, bus.log_dropped, "frame is", "frames are",
               "missing in the log: the disk was too slow or failed");
  add_sentence(sentences, bus.send_errors, "frame", "frames",
               bus.send_fault.empty() ? "could not be sent while the bus was lost"
                                      : "could not be sent (the first: " + bus.send_fault + ")");
  add_sentence(sentences, bus.play_unsent, "frame of the log", "frames of the log", "could not be sent");
  return sentences;
}

std::vector<BusSentence> remarks_of(const CanRecord& bus) {
  std::vector<BusSentence> sentences;
  add_sentence(sentences, bus.played, "frame of a log was", "frames of a log were", "sent");
  add_sentence(sentences, bus.play_unknown_id, "frame of the log has", "frames of the log have",
               "an identifier that the database does not have: only other stations can read such a frame");
  add_sentence(sentences, bus.fault_dropped_tx, "sent frame was", "sent frames were",
               "dropped by fault injection (drop, or delay beyond the end of the run): counted as sent, but "
               "neither on the bus nor in the log");
  add_sentence(
      sentences, bus.fault_dropped_rx, "frame of other stations was", "frames of other stations were",
      "dropped by fault injection (drop, or delay beyond the end of the run): neither received nor in "
      "the log");
  add_sentence(sentences, bus.fault_corrupted, "frame was", "frames were",
               "corrupted by fault injection: the log shows the frame as it was on the bus");
  add_sentence(sentences, bus.fault_delayed, "frame was", "frames were",
               "delayed by fault injection: the log has the time on the bus");
  add_sentence(sentences, bus.wrong_kind, "received frame was", "received frames were",
               "rejected: a remote request, or of another format (classic, CAN FD) than the message");
  for (const RejectionCounts& counts : bus.rejected) {
    const std::string message = "of the message " + counts.message;
    add_sentence(sentences, counts.bad_checksum, "received frame was", "received frames were",
                 "rejected for the checksum " + message);
    add_sentence(sentences, counts.bad_counter, "received frame was", "received frames were",
                 "rejected for the counter " + message);
    add_sentence(sentences, counts.by_scenario, "rejected frame was", "rejected frames were",
                 "caused by the scenario: a fault or a new pass of a log (" + message + ")");
  }
  for (const FrameLengths& lengths : bus.other_lengths) {
    add_sentence(sentences, lengths.longer, "received frame was", "received frames were",
                 "longer than the message " + lengths.message + ": the bytes after the message are padding");
    add_sentence(sentences, lengths.shorter, "received frame was", "received frames were",
                 "shorter than the message " + lengths.message +
                     ": only the signals that the frame contains completely were updated");
  }
  add_sentence(sentences, bus.lost_arrivals, "received frame is", "received frames are",
               "missing in the expectations: more came in one tick than are kept");
  return sentences;
}

}  // namespace

CanRecord record_of(const io::can::CanDevice& device) {
  const io::can::CanCounters counters = device.counters();
  CanRecord bus;
  bus.bus = device.name();
  bus.driver = device.bus().description();
  bus.rx = counters.rx;
  bus.tx = counters.tx;
  bus.dropped = counters.dropped;
  bus.errors = counters.errors;
  bus.no_buffer = counters.no_buffer;
  bus.bad_checksum = counters.bad_checksum;
  bus.bad_counter = counters.bad_counter;
  bus.unknown_id = counters.unknown_id;
  bus.bus_load_mean = counters.bus_load_mean;
  bus.bus_load_peak = counters.bus_load_peak;
  bus.send_errors = counters.send_errors;
  bus.send_fault = device.send_fault();
  bus.wrong_kind = counters.wrong_kind;
  bus.saturated = counters.saturated;
  bus.refused_values = counters.refused_values;
  bus.dropped_releases = counters.dropped_releases;
  bus.log_dropped = counters.log_dropped;
  bus.lost_arrivals = counters.lost_arrivals;
  bus.fault_dropped_tx = counters.injected.dropped_tx;
  bus.fault_dropped_rx = counters.injected.dropped_rx;
  bus.fault_corrupted = counters.injected.corrupted;
  bus.fault_delayed = counters.injected.delayed;
  bus.played = counters.played;
  if (const auto playback = device.playback()) {
    bus.play_unknown_id = playback->sent_unknown;
    bus.play_unsent = playback->dropped;
  }
  for (const io::can::LengthCounts& counts : device.other_lengths())
    bus.other_lengths.push_back({counts.message, counts.longer, counts.shorter});
  bus.rejected = device.rejections();
  return bus;
}

std::vector<contribution::BusColumn> can_columns() {
  return {{"bus", "Bus"},
          {"driver", "Driver"},
          {"rx", "Received"},
          {"tx", "Sent"},
          {"dropped", "Dropped", true},
          {"errors", "Error frames", true},
          {"no_buffer", "No buffer", true},
          {"bad_checksum", "Bad checksum", true},
          {"bad_counter", "Bad counter", true},
          {"unknown_id", "Unknown id"},
          {"bus_load_mean", "Mean load"},
          {"bus_load_peak", "Peak in 0.1 s"}};
}

contribution::BusRecord to_record(const CanRecord& bus) {
  std::vector<contribution::BusRow> other_lengths;
  for (const FrameLengths& lengths : bus.other_lengths) {
    other_lengths.push_back(
        {{"message", lengths.message}, {"longer", lengths.longer}, {"shorter", lengths.shorter}});
  }
  std::vector<contribution::BusRow> rejected;
  for (const RejectionCounts& counts : bus.rejected) {
    rejected.push_back({{"message", counts.message},
                        {"bad_checksum", counts.bad_checksum},
                        {"bad_counter", counts.bad_counter},
                        {"wrong_kind", counts.wrong_kind},
                        {"by_scenario", counts.by_scenario}});
  }
  return {.name = bus.bus,
          .fields = {{"driver", bus.driver},
                     {"rx", bus.rx},
                     {"tx", bus.tx},
                     {"dropped", bus.dropped},
                     {"errors", bus.errors},
                     {"no_buffer", bus.no_buffer},
                     {"bad_checksum", bus.bad_checksum},
                     {"bad_counter", bus.bad_counter},
                     {"unknown_id", bus.unknown_id},
                     {"bus_load_mean", bus.bus_load_mean},
                     {"bus_load_peak", bus.bus_load_peak},
                     {"send_errors", bus.send_errors},
                     {"send_fault", bus.send_fault},
                     {"wrong_kind", bus.wrong_kind},
                     {"saturated", bus.saturated},
                     {"refused_values", bus.refused_values},
                     {"dropped_releases", bus.dropped_releases},
                     {"log_dropped", bus.log_dropped},
                     {"lost_arrivals", bus.lost_arrivals},
                     {"fault_dropped_tx", bus.fault_dropped_tx},
                     {"fault_dropped_rx", bus.fault_dropped_rx},
                     {"fault_corrupted", bus.fault_corrupted},
                     {"fault_delayed", bus.fault_delayed},
                     {"played", bus.played},
                     {"play_unknown_id", bus.play_unknown_id},
                     {"play_unsent", bus.play_unsent},
                     {"other_lengths", std::move(other_lengths)},
                     {"rejected", std::move(rejected)}},
          .faults = faults_of(bus),
          .remarks = remarks_of(bus),
          .dropped_releases = bus.dropped_releases};
}

}  // namespace hil::buses::can
