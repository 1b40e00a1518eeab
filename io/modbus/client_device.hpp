#pragma once
// A Modbus TCP client: hil reads and writes the registers of a unit (a PLC, a drive, a remote I/O).
//
// outputs() are the writable entries of its register map and inputs() the others, each in the order of the
// map. A released set of outputs is one cycle: the values are written, then all inputs are read. Releases are
// states, not messages: when a second set is released before the first was sent, only the newest is sent
// (counted: superseded_releases).
//
// Real time: the cycle runs in a thread of the device. A silent, dead or slow unit delays that thread only,
// never the tick or another device. Lockstep: there is no thread; exchange() runs the cycle for what was
// released since the last exchange, and returns true at once if nothing was.
//
// An input keeps its last value with its arrival time until it is older than `max_age`; then it is not fresh
// and reads its safe value. A request without a complete reply in time closes the connection, so that a late
// reply can never be taken for that of another request (client_session.hpp). While cycles fail, the device
// reconnects with a pause that doubles from `reconnect_pause_min` to `reconnect_pause_max`.
//
// The unit counts as connected from the start, and as not connected after a failed cycle or when a release
// has waited for longer than `max_age` without any cycle ending. A unit without inputs receives its outputs
// again after half of `max_age` without a reply, so that its loss is detected.
//
// Threads: as in io/device.hpp; any ordinary thread may call counters() and fault().

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "io/device.hpp"
#include "io/handover/kept_arrivals.hpp"
#include "io/handover/latest_value.hpp"
#include "io/modbus/client_counters.hpp"
#include "io/modbus/client_session.hpp"
#include "io/modbus/cycle_watch.hpp"
#include "io/modbus/event_list.hpp"
#include "io/modbus/freshness_watch.hpp"
#include "io/modbus/register_map.hpp"
#include "io/modbus/request_plan.hpp"
#include "io/modbus/tcp_endpoint.hpp"
#include "io/modbus/unit_faults.hpp"
#include "io/modbus/value_watch.hpp"
#include "io/modbus/wake_signal.hpp"

namespace hil::io::modbus {

struct ClientSettings {
  std::string name{};  ///< name of the device in the configuration
  Endpoint endpoint{};
  std::uint8_t unit = 1;  ///< unit identifier in every request
  std::chrono::microseconds response_timeout{
      500'000};  ///< per request until its reply is complete; also per connect
  std::chrono::milliseconds start_timeout{2'000};  ///< how long start() tries to reach the unit
  std::chrono::milliseconds reconnect_pause_min{50};
  std::chrono::milliseconds reconnect_pause_max{2'000};
  std::chrono::milliseconds max_age{1'000};         ///< age up to which an input is fresh
  std::chrono::milliseconds lockstep_limit{2'000};  ///< wall-clock time of one exchange()
  std::chrono::milliseconds stop_limit{500};        ///< wall-clock time that stop() gives the last cycle
  /// The largest number of unmapped addresses between two entries that are read in one request with both. If
  /// a unit refuses such a request with exception 2, the request is split at its gaps for the rest of the
  /// device's life.
  std::uint16_t max_gap = 0;
  bool write_unchanged = false;  ///< true: every cycle writes every output; false: requests whose registers
                                 ///< changed, and all after each connect
  /// A writable entry that the device sets to the run time of the release in milliseconds. It is written last
  /// and in a request of its own, so that a unit with stepped time has the outputs before. Empty: none. It is
  /// not among outputs().
  std::string run_time_ms_entry{};
  /// A writable integer entry that the device increments in every cycle, from its minimum (or 0) to its
  /// maximum and then from the minimum again, for the unit's watchdog. Empty: none. It is not among
  /// outputs().
  std::string heartbeat_entry{};
  /// Real time: called in the device's thread before its work (name, priority); may be empty.
  std::function<void()> on_thread_start{};
  /// While it is true, start() fails at once instead of trying again. May be null; outlives the device.
  const std::atomic<bool>* stop_requested = nullptr;
};

class ClientDevice final : public Device, public ArrivalSource, public FaultTarget {
 public:
  /// Does not use the network. Misuse (asserts): a map with mistakes_in(map, Role::client); times that are
  /// not positive; an entry named in `settings` that is missing or not writable.
  ClientDevice(ClientSettings settings, RegisterMap map);
  ~ClientDevice() override;
  ClientDevice(const ClientDevice&) = delete;
  ClientDevice& operator=(const ClientDevice&) = delete;

  const std::string& name() const noexcept override { return settings_.name; }
  std::span<const ChannelInfo> inputs() const noexcept override { return inputs_; }
  std::span<const ChannelInfo> outputs() const noexcept override { return outputs_; }
  std::span<const InputGroup> input_groups() const noexcept override { return groups_; }
  /// `max_age`.
  RunTimeNs loss_timeout_ns() const noexcept override {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(settings_.max_age).count();
  }

  /// Connects, retrying for `start_timeout`. Throws DeviceError when the unit can not be reached in it, or
  /// when `stop_requested` is true after an attempt.
  void start(const RunClock& clock, Pacing pacing) override;
  void latch_inputs(std::span<Sample> samples) noexcept override;
  bool keep_arrivals(std::size_t input) override;
  std::optional<Arrival> next_arrival(std::span<InputValue> values) noexcept override;
  std::uint64_t lost_arrivals() const noexcept override { return arrivals_.lost(); }
  void release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept override;
  bool exchange(RunTimeNs tick_ns) override;
  /// In lockstep the values are sent before this returns, within `lockstep_limit`, or twice that while an
  /// exchange is running.
  void enter_safe_state() noexcept override;
  void stop() noexcept override;
  bool connected() const noexcept override;
  bool has_answered() const noexcept override { return answered_.load(std::memory_order_relaxed); }
  std::string fault() const override;
  /// A write that the unit refuses with exceptions for longer than `max_age` is a send fault.
  std::string send_fault() const override;
  ArrivalSource* arrival_source() noexcept override { return this; }
  FaultTarget* fault_target() noexcept override { return this; }
  /// Before start: adds a fault, which is not active. The first one has number 0.
  void add_fault(const Interference& injected) { faults_.add(injected); }
  bool silences(std::size_t number) const noexcept override {
    const Interference& injected = faults_.injected(number);
    return !injected.only_delays() || injected.delay > settings_.response_timeout ||
           injected.delay > settings_.max_age;
  }
  void set_fault(std::size_t number, bool active) noexcept override {
    faults_.set(number, active);
    if (clock_ != nullptr && pacing_ == Pacing::realtime) wake_signal_.wake();
  }
  std::uint64_t fault_count(std::size_t number) const noexcept override { return faults_.count(number); }
  std::uint64_t fault_effects(std::size_t number) const noexcept override { return faults_.effects(number); }
  void set_away(int /*process_group*/, bool away) override { is_away_ = away; }
  std::vector<DeviceEvent> events_since(std::size_t first) const override;

  ClientCounters counters() const noexcept;
  const RegisterMap& map() const noexcept { return map_; }

 private:
  using WallClock = std::chrono::steady_clock;
  using WallTime = WallClock::time_point;

  /// A cycle ends at `until`, after `length`. Default: its requests alone are limited.
  struct CycleLimit {
    WallTime until = WallTime::max();
    std::chrono::milliseconds length{0};
  };
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
    std::vector<std::uint16_t> image;           ///< the desired register values of the unit
    std::vector<std::uint16_t> written;         ///< the values written last; empty: none since the connect
    std::optional<RunTimeNs> refused_since_ns;  ///< since when the unit has refused it with exceptions
  };

  void build_channels();
  void build_requests();
  void run() noexcept;
  void wait_for_work();
  void take_work() noexcept;
  static CycleLimit limit_from_now(std::chrono::milliseconds length);
  bool cycle(const CycleLimit& limit);
  bool run_cycle(const CycleLimit& limit);
  bool connect(const CycleLimit& limit);
  bool write_all(const CycleLimit& limit);
  void note_refusal(WriteRequest& request);
  bool read_all(const CycleLimit& limit);
  void encode_outputs();
  Conversion encode_into(WriteRequest& request, std::size_t entry, double value);
  RunTimeNs now_ns() const noexcept;
  bool is_stalled() const noexcept;
  bool refused_for_its_gaps(Reply reply, const PlannedRequest& plan) const;
  void split_at_gaps(std::size_t read_request);
  bool judge_reply(Reply reply, bool writes, const PlannedRequest& plan);
  TimeLimit request_limit(const CycleLimit& limit) const;
  void lose_connection(const std::string& fault);
  void set_fault(const std::string& fault);

  const ClientSettings settings_;
  const RegisterMap map_;
  const std::string description_;  ///< "Modbus unit plc (127.0.0.1:1502)"
  const std::string label_;        ///< "Modbus unit plc"
  mutable EventList events_;
  std::vector<ChannelInfo> inputs_, outputs_;
  std::vector<InputGroup> groups_;
  std::vector<std::size_t> input_entries_, output_entries_;  ///< channel -> index into the map
  std::vector<std::size_t> channel_of_input_;                ///< index into the map -> input channel
  std::optional<std::size_t> run_time_entry_, heartbeat_entry_;

  // Used by the tick thread.
  LatestValue<Release> releases_;
  LatestValue<ValuesOfArrivals<std::vector<Reading>>> readings_;
  KeptArrivals arrivals_;
  FreshnessWatch freshness_;
  CycleWatch cycle_watch_;
  std::atomic<bool> safe_requested_{false};
  std::atomic<bool> stopping_{false};
  WakeSignal wake_signal_;
  const RunClock* clock_ = nullptr;
  Pacing pacing_ = Pacing::realtime;
  bool started_ = false;

  // Used by the device's thread; in lockstep by the holder of lockstep_mutex_.
  std::mutex lockstep_mutex_;
  ClientSession session_;
  SocketAddress address_;
  std::vector<WriteRequest> write_requests_;
  std::vector<PlannedRequest> read_requests_;
  std::vector<Reading> newest_readings_;
  ValueWatch values_;
  std::vector<double> wanted_;  ///< the desired outputs
  RunTimeNs wanted_tick_ns_ = 0;
  double heartbeat_ = 0.0;
  bool due_ = false;  ///< a cycle has to run until it succeeds
  UnitFaults faults_;
  bool is_away_ = false;                     ///< lock-step: the unit's program is
  std::optional<RunTimeNs> reply_due_ns_{};  ///< lock-step: of a delayed reply
  WallTime next_connect_{};
  std::chrono::milliseconds reconnect_pause_;
  std::string cycle_fault_;    ///< the first exception of the current cycle
  std::string connect_fault_;  ///< why the last attempt to connect failed
  std::thread thread_;

  ClientTally counters_;
  std::atomic<bool> connected_{false};  ///< the last cycle succeeded, or there was none since the start
  std::atomic<bool> answered_{false};   ///< the unit has answered a request
  RunTimeNs last_reply_ns_ = 0;
  mutable std::mutex health_mutex_;  ///< never locked by the tick
  std::string fault_, send_fault_;
};

}  // namespace hil::io::modbus
