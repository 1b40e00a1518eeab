#pragma once
// The buses of a run: opens their devices, exchanges their values with the signals every tick, watches them,
// and closes them.
//
// Opening: make_devices, before the programs that use the addresses are started; start_remaining_devices,
// after the programs have connected (all_programs_connected).
//
// Threads: opening, stop and the record on the thread that opens the run; begin_tick and the tasks on the
// base thread; check, bus_loads and enter_safe_state on any ordinary thread while the run goes on.

#include <atomic>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runtime/buses/bus.hpp"
#include "runtime/executive/executive.hpp"
#include "runtime/expectations/arrivals.hpp"
#include "runtime/recording/recorder.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/device_link.hpp"
#include "runtime/run/device_watch.hpp"
#include "runtime/run/input_watch.hpp"
#include "runtime/run/loss_watch.hpp"
#include "runtime/run/run_context.hpp"
#include "runtime/run/wiring.hpp"

namespace hil::run {

class RunBuses {
 public:
  /// All of them outlive it. `arrivals` keeps the frames that expectations judge.
  RunBuses(Wiring& wiring, RunContext& context, expectations::Arrivals& arrivals)
      : wiring_(wiring), context_(context), arrivals_(arrivals) {}

  // All of opening throws io::DeviceError.
  /// Makes all devices and starts those that programs of the run connect to. `recorder` gets their frames and
  /// outlives them; null: there is no recording.
  void make_devices(recording::Recorder* recorder);
  /// Whether all programs that have the address of a bus have connected to it. `waited_ns`: since the
  /// programs were started.
  bool all_programs_connected(const ProcessWatch& processes, std::int64_t waited_ns) const;
  /// Starts the other devices and links all with their signals.
  void start_remaining_devices();

  /// The text for {section.name} in a command: an address, or the kind of clock.
  std::string address_of(const std::string& section, const std::string& name) const;

  /// Adds a task for each bus, with its full name.
  void add_tasks(executive::Executive& executive);
  // Base thread; neither allocate nor block in real time.
  /// Begins or ends a fault. `name`: of the scenario; it outlives the run.
  void set_fault(const BusFault& fault, const std::string& name, bool active) noexcept;
  /// What faults of a bus act on. The bus has a fault.
  io::FaultTarget& fault_target(std::size_t bus) const noexcept;
  /// The programs of a process that are connected with a bus do not answer, by the fault of this name, or do
  /// so again.
  void set_away(std::size_t bus, pid_t process, const std::string& name, bool away) noexcept;
  /// A fault that makes a task take longer begins or ends.
  void set_task_fault(bool active) noexcept { input_watch_->set_task_fault(active); }
  /// Latches the inputs; the devices' tasks release safe values while a loss is not permitted.
  void begin_tick(std::int64_t time_ns) noexcept;
  /// Notes which inputs were fresh in the tick, when its faults have begun or ended.
  void end_tick(std::int64_t time_ns) noexcept;
  /// False once a device failed in a lock-step exchange and that is not a permitted loss.
  bool in_step() const noexcept;
  /// The reason for that, in a sentence; empty: in_step() is true.
  std::string step_fault() const;

  /// A program that may be lost has ended: what it sent on the bus need not come any more.
  void note_permitted_exit(std::size_t bus) noexcept {
    buses_[bus].lacks_program->store(true, std::memory_order_relaxed);
  }

  /// In real time: writes changes of the devices' states and their events to run.log. Under the virtual clock
  /// begin_tick does, so that they have the same times in each run.
  void check();
  std::vector<report::LiveBus> bus_loads() const;
  void enter_safe_state() noexcept;
  /// Sends the safe values, then closes all devices.
  void stop() noexcept;
  /// After stop: writes the events since the last check to run.log.
  void collect_last_events();

  /// Fills in the groups of buses, and adds the logs that they play to the stimuli. `end_ns`: of the run.
  void fill(std::int64_t end_ns, report::RunRecord& record) const;
  /// Why the run does not pass: inputs that did not come, and rejected frames. After stop.
  std::vector<std::string> input_failures() const;
  const std::vector<report::Event>& events() const noexcept { return device_watch_->events(); }
  const LossWatch& losses() const noexcept { return *loss_watch_; }
  /// Why outputs could not be sent, a sentence for each device concerned.
  std::vector<std::string> send_faults() const;
  /// The log files of the buses, and why they lack frames, in sentences.
  std::vector<std::string> log_files() const;
  std::vector<std::string> log_faults() const;

 private:
  struct RunningBus {
    const WiredBus* wired = nullptr;
    std::unique_ptr<buses::BusDevice> device;
    std::size_t first_input = 0;  ///< of its groups of inputs among those of all buses
    std::unique_ptr<std::atomic<bool>> lacks_program = std::make_unique<std::atomic<bool>>(false);
  };
  /// A group of inputs of a bus, or an input of one.
  struct WatchedInput {
    std::size_t bus = 0;
    std::size_t group = 0;
    std::optional<std::size_t> input{};
    std::uint64_t faulted = 0;  ///< what faults had taken of it at the last tick
    std::int64_t newest_ns = std::numeric_limits<std::int64_t>::min();  ///< of its values then
  };
  void watch_inputs();
  /// The inputs of groups of several that something reads.
  void watch_read_signals(std::vector<InputWatch::InputRule>& rules);
  /// A fault that keeps all values of the bus from coming begins or ends.
  void set_inputs_silenced(std::size_t bus, bool active) noexcept;
  /// What the report shows of the inputs of a bus.
  std::vector<contribution::BusRow> input_rows(const RunningBus& bus) const;
  void start(RunningBus& bus);
  void check_devices(std::int64_t time_ns);
  /// Whether the bus failed in a lock-step exchange and may not be lost.
  bool ends_run(std::size_t bus) const noexcept;
  void keep_judged_arrivals(RunningBus& bus);
  void write_to_log(bool is_expected, const std::string& sentence);
  std::function<void()> thread_start(std::optional<int> priority, const std::string& name);

  Wiring& wiring_;
  RunContext& context_;
  expectations::Arrivals& arrivals_;
  std::vector<RunningBus> buses_;                   ///< in the order of the scenario
  std::vector<std::unique_ptr<DeviceLink>> links_;  ///< by bus
  std::optional<DeviceWatch> device_watch_;
  std::optional<LossWatch> loss_watch_;
  std::vector<WatchedInput> inputs_;             ///< groups of all buses, then inputs
  std::vector<InputWatch::State> input_states_;  ///< of the tick, by input
  std::optional<InputWatch> input_watch_;
};

}  // namespace hil::run
