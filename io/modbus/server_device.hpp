#pragma once
// A Modbus TCP server for external clients: a PLC as master, an HMI, mbpoll.
//
// inputs() are the registers that clients write: the entries of the map that are not `writable`, which must
// be coils or holding registers. outputs() are those that clients read: the `writable` entries of any table,
// which clients may not write. Both have the order of the map. A value of several registers is always read
// completely from one release. A write that leaves a register outside its range is answered with exception 3
// and changes nothing.
//
// Real time: a thread of the device serves the clients; tick and thread exchange states without blocking each
// other. A bad client can only lose its connection (tcp_server.hpp); it never delays the tick. Lockstep:
// there is no thread; exchange() serves what has arrived, so clients wait between two exchanges.
//
// An input is fresh from its first write on, without end or until it is older than `max_age`.
//
// Threads: as in io/device.hpp; any ordinary thread may call port(), counters() and fault().

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
#include "io/modbus/event_list.hpp"
#include "io/modbus/freshness_watch.hpp"
#include "io/modbus/register_bank.hpp"
#include "io/modbus/register_map.hpp"
#include "io/modbus/tcp_endpoint.hpp"
#include "io/modbus/tcp_server.hpp"
#include "io/modbus/unit_faults.hpp"
#include "io/modbus/value_watch.hpp"

namespace hil::io::modbus {

struct ServerSettings {
  std::string name{};                 ///< name of the device in the configuration
  Endpoint endpoint{"127.0.0.1", 0};  ///< port 0: the system chooses one, see ServerDevice::port
  ServerLimits limits{};
  std::chrono::milliseconds max_age{0};             ///< age up to which an input is fresh; 0: no limit
  std::chrono::milliseconds lockstep_limit{1'000};  ///< wall-clock time of one exchange()
  /// Real time: called in the device's thread before its work (name, priority); may be empty.
  std::function<void()> on_thread_start{};
};

class ServerDevice final : public Device, public ArrivalSource, public FaultTarget {
 public:
  /// Does not use the network. Misuse (asserts): a map with mistakes_in(map, Role::server); limits that are
  /// not positive.
  ServerDevice(ServerSettings settings, RegisterMap map);
  ~ServerDevice() override;
  ServerDevice(const ServerDevice&) = delete;
  ServerDevice& operator=(const ServerDevice&) = delete;

  const std::string& name() const noexcept override { return settings_.name; }
  std::span<const ChannelInfo> inputs() const noexcept override { return inputs_; }
  std::span<const ChannelInfo> outputs() const noexcept override { return outputs_; }
  std::span<const InputGroup> input_groups() const noexcept override { return groups_; }
  /// `max_age`.
  RunTimeNs loss_timeout_ns() const noexcept override;

  /// Listens. Throws DeviceError when the port is not available.
  void start(const RunClock& clock, Pacing pacing) override;
  void latch_inputs(std::span<Sample> samples) noexcept override;
  bool keep_arrivals(std::size_t input) override;
  std::optional<Arrival> next_arrival(std::span<InputValue> values) noexcept override;
  std::uint64_t lost_arrivals() const noexcept override { return arrivals_.lost(); }
  void release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept override;
  /// False: clients sent requests for the whole `lockstep_limit`.
  bool exchange(RunTimeNs tick_ns) override;
  void enter_safe_state() noexcept override;
  void stop() noexcept override;
  bool connected() const noexcept override { return server_.clients() > 0; }
  std::string fault() const override { return {}; }
  std::string send_fault() const override { return {}; }

  /// The port it listens on; 0 before start and after stop.
  std::uint16_t port() const noexcept { return port_.load(); }
  ServerCounters counters() const noexcept { return server_.counters(); }
  const RegisterMap& map() const noexcept { return map_; }
  ValueCounters value_counters() const noexcept { return values_.counters(); }
  /// How often an input grew older than `max_age`.
  std::uint64_t stale_inputs() const noexcept { return freshness_.stale(); }
  ArrivalSource* arrival_source() noexcept override { return this; }
  FaultTarget* fault_target() noexcept override { return this; }
  /// Before start: adds a fault, which is not active. The first one has number 0.
  void add_fault(const Interference& injected) { faults_.add(injected); }
  bool silences(std::size_t number) const noexcept override {
    const Interference& injected = faults_.injected(number);
    return !injected.only_delays() || (settings_.max_age.count() > 0 && injected.delay > settings_.max_age);
  }
  void set_fault(std::size_t number, bool active) noexcept override;
  std::uint64_t fault_count(std::size_t number) const noexcept override { return faults_.count(number); }
  std::uint64_t fault_effects(std::size_t number) const noexcept override { return faults_.effects(number); }
  std::vector<DeviceEvent> events_since(std::size_t first) const override;

 private:
  struct Reading {
    double value = 0.0;
    RunTimeNs time_ns = 0;
    bool valid = false;
  };

  void build_channels();
  void run() noexcept;
  void wake() noexcept;
  void bring_outputs_up_to_date() noexcept;
  void take_inputs(const RequestRange& written) noexcept;
  void note_refused_write(const RegisterBank::OutOfRange& refused) noexcept;
  /// The run time for events and values.
  RunTimeNs stamp_ns() const noexcept;

  const ServerSettings settings_;
  const RegisterMap map_;
  const std::string label_;  ///< "Modbus unit panel"
  mutable EventList events_;
  std::vector<ChannelInfo> inputs_, outputs_;
  std::vector<InputGroup> groups_;
  std::vector<std::size_t> input_entries_, output_entries_;  ///< channel -> index into the map

  // Used by the tick thread.
  LatestValue<std::vector<double>> releases_;
  LatestValue<ValuesOfArrivals<std::vector<Reading>>> readings_;
  KeptArrivals arrivals_;
  FreshnessWatch freshness_;
  std::atomic<bool> safe_requested_{false};
  std::atomic<bool> stopping_{false};
  const RunClock* clock_ = nullptr;
  Pacing pacing_ = Pacing::realtime;
  bool started_ = false;

  UnitFaults faults_;

  // Used by the device's thread; in lockstep by the holder of lockstep_mutex_.
  std::mutex lockstep_mutex_;
  RegisterBank bank_;
  TcpServer server_;
  std::vector<Reading> newest_readings_;
  ValueWatch values_;
  RunTimeNs exchange_tick_ns_ = 0;
  Descriptor wake_event_;
  std::thread thread_;
  std::atomic<std::uint16_t> port_{0};
};

}  // namespace hil::io::modbus
