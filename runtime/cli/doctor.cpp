// hil doctor: what this machine permits a run, tried or measured.

#include <pthread.h>
#include <sys/mman.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/buses/bus.hpp"
#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/limited_memory.hpp"
#include "runtime/cli/start_failure.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/executive/clock.hpp"
#include "runtime/executive/histogram.hpp"
#include "runtime/executive/machine.hpp"
#include "runtime/executive/realtime.hpp"
#include "runtime/plugins/plugins.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

void line(const char* topic, const std::string& text) {
  std::printf("%-22s %s\n", topic, text.c_str());
}

/// Measures the wake-up latency of a 1 kHz thread for two seconds, with the scheduling that a run would get.
void measure_wakeups(bool fifo) {
  executive::MonotonicClock clock;
  executive::Histogram latency;
  const executive::RealtimeOptions options{
      .scheduler = fifo ? executive::Scheduler::fifo : executive::Scheduler::other,
      .priority = 60,
      .lock_memory = false,
      .cpus = {}};
  {
    const executive::ThreadRealtime thread(options, options.priority);
    std::int64_t due_ns = clock.now_ns();
    for (int i = 0; i < 2000; ++i) {
      due_ns += 1'000'000;
      clock.sleep_until(due_ns);
      latency.record(clock.now_ns() - due_ns);
    }
  }
  const executive::Quantiles q = latency.quantiles();
  char text[160];
  std::snprintf(text, sizeof text, "1 kHz for 2 s under %s: p50 %.1f us, p99 %.1f us, max %.1f us",
                fifo ? "SCHED_FIFO" : "SCHED_OTHER", static_cast<double>(q.p50_ns) * 1e-3,
                static_cast<double>(q.p99_ns) * 1e-3, static_cast<double>(q.max_ns) * 1e-3);
  line("wake-up latency", text);
}

bool check_scheduling() {
  utsname names{};
  uname(&names);
  line("kernel", std::string(names.release) + " " + names.version);
  const executive::RealtimeOptions options{
      .scheduler = executive::Scheduler::fifo, .priority = 60, .lock_memory = true, .cpus = {}};
  bool fifo = false;
  {
    const executive::ProcessRealtime process(options);
    const executive::ThreadRealtime thread(options, options.priority);
    fifo = thread.fifo();
    line("SCHED_FIFO", fifo ? "granted" : "refused");
    line("locked memory", process.memory_locked() ? "granted" : "refused");
    for (const std::string& sentence : thread.refused())
      line("", sentence);
    for (const std::string& sentence : process.refused())
      line("", sentence);
  }
  for (const std::string& sentence : executive::timing_limits(executive::read_machine_state(), fifo))
    line("limits timing", sentence);
  return fifo;
}

bool check_gpus() {
  const std::vector<rtstdb::DeviceInfo> devices = rtstdb::Database::devices();
  for (std::size_t i = 0; i < devices.size(); ++i) {
    line("Vulkan device", std::to_string(i) + ": " + devices[i].name + ", " + devices[i].driver +
                              ", Vulkan " + devices[i].api + (devices[i].software ? " (software)" : "") +
                              (devices[i].draws ? "" : ", can not draw: first hits of images are traced"));
  }
  const auto opened = rtstdb::Database::open({});
  line("database", opened ? "opens on " + opened.value()->device().name : opened.error().message);
  return opened.ok();
}

void check_buses() {
  for (const buses::BusType& type : buses::bus_types()) {
    if (type.doctor_lines == nullptr) continue;
    for (const buses::DoctorLine& entry : type.doctor_lines())
      line(entry.topic.c_str(), entry.text);
  }
}

/// Reads the files; runs nothing of them.
void list_plugins() {
  for (const std::filesystem::path& folder : plugins::plugin_folders()) {
    std::error_code error;
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::directory_iterator(folder, error))
      if (entry.path().extension() == ".so") files.push_back(entry.path());
    std::ranges::sort(files);
    for (const std::filesystem::path& file : files) {
      std::string fault;
      const auto plugin = plugins::read_plugin(file, fault);
      line("plug-in",
           plugin ? plugin->name + " " + plugin->version + ": " + plugin->path + ", " + plugin->hash : fault);
    }
  }
}

}  // namespace

void add_doctor(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("doctor", "show what this machine permits: Vulkan, CAN, real time, wake-up latency");
  command->callback([&exit_code] {
    exit_code = run_within_limits(
        [] {
          const bool gpu = check_gpus();
          check_buses();
          list_plugins();
          measure_wakeups(check_scheduling());
          return flush_output("doctor", gpu ? run::exit_passed : run::exit_gpu_failed);
        },
        [](const std::string& end) { return report_lack_of_memory("doctor", end); });
  });
}

}  // namespace hil::cli
