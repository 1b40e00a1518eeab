#pragma once
// A Modbus TCP unit that hil is the client of: a PLC, a drive, a remote I/O.
//
// outputs() are the writable entries of its register map and inputs() the others, each in the order of the
// map. A released set of outputs is one cycle: the values are written, then all inputs are read. Releases are
// states, not messages: when a second set is released before the first was sent, only the newest is sent
// (counted: superseded_releases).
//
// Real time: the cycle runs in a thread of the device's own. A unit that is silent, dead or slow costs that
// thread alone, never the tick and never another device. Lockstep: no thread; exchange() runs the cycle of
// what was released since the last exchange, and returns true at once when nothing was.
//
// An input keeps its last value, with the time it arrived, until it is older than `max_age`; from then on it
// is not fresh and reads its safe value. A request that gets no whole reply in time costs the connection, so
// that a late reply can never be taken for another's (client_session.hpp); the connection is made again with
// a pause that doubles from `reconnect_pause_min` to `reconnect_pause_max` while cycles fail.
//
// The unit counts as connected from the start on, and as not connected after a failed cycle or while a
// release waits for longer than `max_age` and no cycle ends. A unit without inputs gets its outputs again
// after half of `max_age` without a reply, so that its loss is noticed.
//
// Threads: as in io/device.hpp; counters() and fault() from any ordinary thread.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "io/device.hpp"
#include "io/handover/latest_value.hpp"
#include "io/modbus/client_session.hpp"
#include "io/modbus/cycle_watch.hpp"
#include "io/modbus/event_list.hpp"
#include "io/modbus/exception_counts.hpp"
#include "io/modbus/freshness_watch.hpp"
#include "io/modbus/register_map.hpp"
#include "io/modbus/request_plan.hpp"
#include "io/modbus/tcp_endpoint.hpp"
#include "io/modbus/value_watch.hpp"
#include "io/modbus/wake_signal.hpp"

namespace hil::io::modbus {

struct ClientSettings {
  std::string name{};  ///< of the device, as in the configuration
  Endpoint endpoint{};
  std::uint8_t unit = 1;  ///< unit identifier in every request
  std::chrono::microseconds response_timeout{
      500'000};                                  ///< per request, until its reply is whole; also per connect
  std::chrono::milliseconds start_limit{2'000};  ///< how long start() tries to reach the unit
  std::chrono::milliseconds reconnect_pause_min{50};
  std::chrono::milliseconds reconnect_pause_max{2'000};
  std::chrono::milliseconds max_age{1'000};         ///< of an input that counts as fresh
  std::chrono::milliseconds lockstep_limit{2'000};  ///< wall-clock time of one exchange()
  std::chrono::milliseconds stop_limit{500};        ///< wall-clock time stop() gives the last cycle
  /// The largest number of addresses between two entries, of no entry themselves, that are read along so that
  /// one request carries both entries. A unit that does not have such addresses refuses the request with
  /// exception 2; the request is then split at its gaps for the rest of the device's life.
  std::uint16_t max_gap = 0;
  bool write_unchanged = false;  ///< true: every cycle writes every output; false: requests whose registers
                                 ///< changed, and all after each connect
  /// A writable entry that the device fills itself with the run time of the release, in milliseconds. Written
  /// after all others and in a request of its own, so that a unit with stepped time sees the outputs first.
  /// Empty: none. It is not among outputs().
  std::string run_time_ms_entry{};
  /// A writable integer entry that the device counts up by one in every cycle, from its minimum (or 0) to its
  /// maximum and over again, so that the unit's watchdog sees hil alive. Empty: none. Not among outputs().
  std::string heartbeat_entry{};
};

/// All since construction. reconnects: connections after the first.
struct ClientCounters {
  std::uint64_t requests = 0;
  std::uint64_t replies = 0;   ///< good ones and exceptions
  std::uint64_t timeouts = 0;  ///< requests without a whole reply in time
  std::uint64_t errors = 0;    ///< exceptions, broken connections and replies that are none
  std::uint64_t exceptions = 0;
  ExceptionCounts by_code{};  ///< the exceptions, by code
  std::uint64_t reconnects = 0;
  ValueCounters values{};  ///< one that is not a number leaves the register as it was: with the value written
                           ///< before, or with the safe value
  std::uint64_t superseded_releases = 0;
  std::uint64_t stale_inputs = 0;  ///< how often an input grew older than max_age
};

class ClientDevice final : public Device {
 public:
  /// Does not touch the network. Misuse (asserts): a map in which mistakes_in(map, Role::client) finds
  /// something; times that are not positive; an entry named in `settings` that is not writable or not there.
  ClientDevice(ClientSettings settings, RegisterMap map);
  ~ClientDevice() override;
  ClientDevice(const ClientDevice&) = delete;
  ClientDevice& operator=(const ClientDevice&) = delete;

  const std::string& name() const noexcept override { return settings_.name; }
  std::span<const ChannelInfo> inputs() const noexcept override { return inputs_; }
  std::span<const ChannelInfo> outputs() const noexcept override { return outputs_; }
  std::span<const InputGroup> input_groups() const noexcept override { return groups_; }
  /// `max_age`.
  RunTimeNs loss_timeout_ns() const noexcept override;

  /// Connects, trying again for `start_limit`; DeviceError when the unit can not be reached by then.
  void start(const RunClock& clock, Pacing pacing) override;
  void latch_inputs(std::span<Sample> samples) noexcept override;
  void release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept override;
  bool exchange(RunTimeNs tick_ns) override;
  /// In lockstep the values are sent before this returns (bounded by `lockstep_limit`, twice when an exchange
  /// is under way).
  void enter_safe_state() noexcept override;
  void stop() noexcept override;
  bool connected() const noexcept override;
  bool has_answered() const noexcept override { return answered_.load(std::memory_order_relaxed); }
  std::string fault() const override;
  /// A write that the unit refuses with exceptions for longer than `max_age` is a send fault.
  std::string send_fault() const override;
  std::vector<DeviceEvent> events_since(std::size_t first) const override;

  ClientCounters counters() const noexcept;

 private:
  using WallClock = std::chrono::steady_clock;
  using WallTime = WallClock::time_point;

  struct Release {
    std::vector<double> values;
    RunTimeNs tick_ns = 0;
  };
  struct Reading {
    double value = 0.0;
    RunTimeNs time_ns = 0;
    bool valid = false;
  };
  struct WriteRequest {
    PlannedRequest plan;
    std::vector<std::uint16_t> image;    ///< what the unit should hold
    std::vector<std::uint16_t> written;  ///< what was last written to it; empty: nothing since the connect
    std::optional<RunTimeNs> refused_since_ns;  ///< since when the unit answers it with exceptions
  };
  struct AtomicCounters {
    std::atomic<std::uint64_t> requests{0}, replies{0}, timeouts{0}, errors{0}, connects{0}, superseded{0};
    ExceptionTally exceptions;
  };

  void build_channels();
  void build_requests();
  void run() noexcept;
  void wait_for_work();
  void take_work() noexcept;
  bool cycle(WallTime until);
  bool run_cycle(WallTime until);
  bool connect_until(WallTime until);
  bool write_all(WallTime until);
  void note_refusal(WriteRequest& request);
  bool read_all(WallTime until);
  void encode_outputs();
  Conversion encode_into(WriteRequest& request, std::size_t entry, double value);
  RunTimeNs now_ns() const noexcept;
  bool is_stalled() const noexcept;
  bool refused_for_its_gaps(Reply reply, const PlannedRequest& plan) const;
  void split_at_gaps(std::size_t read_request);
  bool settle(Reply reply, const char* verb, const PlannedRequest& plan);
  std::chrono::microseconds request_limit(WallTime until) const;
  void lose_connection(const std::string& fault);
  void set_fault(const std::string& fault);

  const ClientSettings settings_;
  const RegisterMap map_;
  const std::string who_;    ///< "Modbus unit plc (127.0.0.1:1502)"
  const std::string label_;  ///< "unit plc"
  mutable EventList events_;
  std::vector<ChannelInfo> inputs_, outputs_;
  std::vector<InputGroup> groups_;
  std::vector<std::size_t> input_entries_, output_entries_;  ///< channel -> index into the map
  std::vector<std::size_t> channel_of_input_;                ///< index into the map -> input channel
  std::optional<std::size_t> run_time_entry_, heartbeat_entry_;

  // The tick's side.
  LatestValue<Release> releases_;
  LatestValue<std::vector<Reading>> readings_;
  FreshnessWatch freshness_;
  CycleWatch cycle_watch_;
  std::atomic<bool> safe_requested_{false};
  std::atomic<bool> stopping_{false};
  WakeSignal wake_signal_;
  const RunClock* clock_ = nullptr;
  Pacing pacing_ = Pacing::realtime;
  bool started_ = false;

  // The cycle's side: the device's thread, or in lockstep whoever holds lockstep_mutex_.
  std::mutex lockstep_mutex_;
  ClientSession session_;
  SocketAddress address_;
  std::vector<WriteRequest> write_requests_;
  std::vector<PlannedRequest> read_requests_;
  std::vector<Reading> newest_readings_;
  ValueWatch values_;
  std::vector<double> wanted_;  ///< outputs the unit should hold
  RunTimeNs wanted_tick_ns_ = 0;
  double heartbeat_ = 0.0;
  bool due_ = false;  ///< a cycle has yet to succeed
  WallTime next_connect_{};
  std::chrono::milliseconds reconnect_pause_;
  std::string cycle_fault_;    ///< the first exception of the cycle under way
  std::string connect_fault_;  ///< why the last attempt to connect failed
  std::thread thread_;

  AtomicCounters counters_;
  std::atomic<bool> connected_{false};  ///< the last cycle succeeded, or there was none since the start
  std::atomic<bool> answered_{false};   ///< the unit has answered a request
  RunTimeNs last_reply_ns_ = 0;
  mutable std::mutex health_mutex_;  ///< never taken by the tick
  std::string fault_, send_fault_;
};

}  // namespace hil::io::modbus
