#pragma once
// A run while it lives: everything that is open, and the hooks of the tick. session.cpp runs and closes it
// and makes its record; live_session_open.cpp opens it. Nobody else includes this.

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "io/virtual/hub.hpp"
#include "runtime/executive/executive.hpp"
#include "runtime/run/device_watch.hpp"
#include "runtime/run/expectations.hpp"
#include "runtime/run/loss_watch.hpp"
#include "runtime/run/process_watch.hpp"
#include "runtime/run/run_log.hpp"
#include "runtime/run/session.hpp"
#include "runtime/run/signal_log.hpp"

namespace hil::run {

/// Sentences that threads add while the run goes on.
class Sentences {
 public:
  void add(const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    if (std::find(all_.begin(), all_.end(), sentence) == all_.end()) all_.push_back(sentence);
  }
  std::vector<std::string> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> all_;
};

class LiveSession final : public executive::TickHooks {
 public:
  LiveSession(Wiring wiring, const SessionOptions& options)
      : wiring_(std::move(wiring)),
        scenario_(*wiring_.scenario),
        options_(options),
        virtual_(scenario_.clock == config::ClockKind::virtual_time),
        database_clock_(clock()),
        device_clock_(clock()),
        run_log_(options.directory / "run.log", options.verbose) {}
  ~LiveSession() override { close_devices(); }

  void open(const std::atomic<bool>& stop_requested) {
    outer_stop_ = &stop_requested;
    run_log_.info("scenario " + scenario_.name + " from " + scenario_.file);
    open_world();
    open_buses();
    choose_ports();
    open_modbus(io::modbus::Role::server);  // programs may be its clients
    start_processes();
    wait_for_stations();
    open_clients();
    link_devices();
    make_judges();
  }

  SessionResult run(const std::atomic<bool>& stop_requested);

  void before_first_tick(std::int64_t start_ns) noexcept override {
    device_clock_.set_origin(start_ns);
    arrivals_.begin();
  }
  void begin_tick(const executive::TickInfo& tick) noexcept override {
    for (const auto& link : links_)
      link->latch_inputs(tick.time_ns);
    loss_watch_->look(tick.time_ns);
    for (const auto& link : links_)
      link->hold_safe_values(loss_watch_->outputs_must_be_safe());
  }
  void end_tick(const executive::TickInfo& tick) noexcept override {
    const std::span<const Arrival> arrived = arrivals_.collect();
    for (const auto& judge : judges_)
      judge->look(wiring_.signals, arrived, tick.time_ns);
    if (tick.tick % log_every_ticks_ == 0) log_->take(wiring_.signals, tick.time_ns);
    bool in_step = true;
    for (const auto& link : links_)
      in_step = in_step && link->in_step();
    if (!in_step || outer_stop_->load(std::memory_order_relaxed)) {
      stop_.store(true, std::memory_order_relaxed);
    }
  }

 private:
  struct Station {
    const config::ProcessSection* program = nullptr;
    std::size_t connections = 0;
  };
  struct Bus {
    const WiredCan* wired = nullptr;
    std::unique_ptr<io::can::CanDevice> device;
    io::virtual_bus::Hub* hub = nullptr;  // of a virtual bus
    std::vector<Station> stations;        // programs that connect to it
  };

  executive::Clock& clock() noexcept {
    return virtual_ ? static_cast<executive::Clock&>(virtual_clock_)
                    : static_cast<executive::Clock&>(monotonic_clock_);
  }
  io::Pacing pacing() const noexcept { return virtual_ ? io::Pacing::lockstep : io::Pacing::realtime; }

  void open_world();
  rtstdb::DurabilityOptions durability() const;
  /// What a history of this run needs beside the database's log.
  void write_world_record() const;
  void open_buses();
  void keep_judged_arrivals(Bus& bus);
  void choose_ports();
  void start_processes();
  void wait_for_stations();
  bool all_connected(Bus& bus, std::int64_t waited_ns);
  void open_modbus(io::modbus::Role role);
  /// Connects to the units that hil is the client of; programs of the run may serve them.
  void open_clients();
  void link_devices();
  void make_judges();
  void close_devices() noexcept;
  std::function<void()> thread_start(std::optional<int> priority, const std::string& who);
  /// What stands for {section.name} in a command.
  std::string address_of(const std::string& section, const std::string& name) const;
  void add_tasks(executive::Executive& executive);
  /// Programs, devices and the console are looked after while it runs.
  executive::RunResult run_watched(executive::Executive& executive);
  report::LiveStatus live_status(const executive::Executive& executive);
  /// A lost device that another one takes the place of is told; one that stays away ends the run.
  void look_at_gpu();
  /// A world that can not be written any more is no world to test in: the run ends.
  void look_at_log();
  /// From here on transactions come to nothing.
  void end_database(report::RunRecord& record);
  /// Closes signals.csv and hears of every log whether all of it was written. After close_devices.
  void end_logs();
  void tell_unanswered_runs(report::RunRecord& record) const;
  void fill_record(const executive::RunResult& result, report::RunRecord& record);
  void add_contributions(std::int64_t end_ns, report::RunRecord& record) const;
  std::string io_fault() const;
  /// Fills in the losses, and the failures outside the run.
  void add_failures(std::int64_t end_ns, report::RunRecord& record) const;

  Wiring wiring_;
  const config::Scenario& scenario_;
  const SessionOptions& options_;
  const bool virtual_;
  executive::MonotonicClock monotonic_clock_;
  executive::VirtualClock virtual_clock_;
  DatabaseClock database_clock_;
  DeviceClock device_clock_;
  RunLog run_log_;
  Sentences degraded_;

  std::unique_ptr<rtstdb::Database> database_;
  std::unique_ptr<modules::World> world_;
  modules::EventLog events_;
  std::vector<std::unique_ptr<ModuleTask>> module_tasks_;

  std::vector<Bus> buses_;
  struct Unit {
    const WiredModbus* wired = nullptr;
    io::modbus::Endpoint endpoint;
    std::unique_ptr<io::modbus::ClientDevice> client;
    std::unique_ptr<io::modbus::ServerDevice> server;
    io::Device& device() const {
      return client ? static_cast<io::Device&>(*client) : static_cast<io::Device&>(*server);
    }
  };
  std::vector<Unit> units_;
  std::vector<std::unique_ptr<DeviceLink>> links_;
  std::optional<DeviceWatch> device_watch_;
  std::optional<LossWatch> loss_watch_;
  std::unique_ptr<ProcessWatch> processes_;
  std::vector<ProcessExit> exits_;

  Arrivals arrivals_;
  std::vector<std::unique_ptr<Judge>> judges_;
  std::unique_ptr<SignalLog> log_;
  std::vector<std::string> write_faults_;  ///< why files of the run lack something, one sentence each
  std::uint64_t log_every_ticks_ = 1;

  std::atomic<bool> stop_{false};
  const std::atomic<bool>* outer_stop_ = nullptr;
  std::uint64_t gpu_losses_ = 0;  ///< told so far
  bool gpu_was_lost_ = false;     ///< at the last look
  bool log_has_refused_ = false;
  std::uint64_t last_live_ticks_ = 0;
};

}  // namespace hil::run
