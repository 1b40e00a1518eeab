#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>

#include "runtime/cli/load.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/report/report_files.hpp"
#include "runtime/report/report_json.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

std::atomic<bool> stop_requested{false};

/// The first SIGINT or SIGTERM ends the run in order; a second one ends the program.
void request_stop(int signal) {
  if (stop_requested.exchange(true)) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
}

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = request_stop;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  // A broken pipe of a console that has gone is no reason to leave outputs as they are.
  std::signal(SIGPIPE, SIG_IGN);
}

struct Arguments {
  std::string scenario;
  std::vector<std::string> overrides;
  std::string duration, clock, seed, directory;
  std::optional<std::string> fail_on;
  bool verbose = false;
};

/// --duration, --clock and --seed are settings like any other.
std::vector<std::string> all_overrides(const Arguments& arguments, bool seed_given) {
  std::vector<std::string> overrides = arguments.overrides;
  if (!arguments.duration.empty()) overrides.push_back("duration=" + arguments.duration);
  if (!arguments.clock.empty()) overrides.push_back("clock=" + arguments.clock);
  if (seed_given) overrides.push_back("seed=" + arguments.seed);
  return overrides;
}

std::vector<report::Override> as_pairs(const std::vector<std::string>& overrides) {
  std::vector<report::Override> pairs;
  for (const std::string& text : overrides) {
    const std::size_t equals = text.find('=');
    pairs.push_back({text.substr(0, equals), text.substr(equals + 1)});
  }
  return pairs;
}

std::filesystem::path default_directory(const std::string& scenario) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  localtime_r(&now, &parts);
  char stamp[32];
  std::strftime(stamp, sizeof stamp, "%Y%m%d-%H%M%S", &parts);
  const std::filesystem::path base =
      std::filesystem::path("out") / (std::filesystem::path(scenario).stem().string() + "-" + stamp);
  // Two runs begun in one second do not share a folder.
  std::filesystem::path directory = base;
  for (int i = 2; std::filesystem::exists(directory); ++i)
    directory = base.string() + "-" + std::to_string(i);
  return directory;
}

std::filesystem::path own_folder() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path();
}

std::size_t terminal_columns() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

int run(const Arguments& arguments, bool seed_given) {
  const std::vector<std::string> overrides = all_overrides(arguments, seed_given);
  run::SessionOptions options;
  if (arguments.fail_on) {
    config::Diagnostics diagnostics;
    options.fail_on = run::parse_fail_on(*arguments.fail_on, diagnostics);
    if (!options.fail_on) {
      std::fputs(diagnostics.to_text().c_str(), stderr);
      return run::exit_bad_config;
    }
  }
  auto loaded = load(arguments.scenario, overrides);
  if (!loaded) return run::exit_bad_config;
  options.directory = arguments.directory.empty() ? default_directory(arguments.scenario)
                                                  : std::filesystem::path(arguments.directory);
  options.overrides = as_pairs(overrides);
  options.verbose = arguments.verbose;
  options.program_folders = {own_folder()};
  const bool live = isatty(STDOUT_FILENO) != 0;
  if (live) {
    options.every_second = [](const report::LiveStatus& status) {
      std::printf("\r\033[K%s", report::live_line(status, terminal_columns() - 1).c_str());
      std::fflush(stdout);
    };
  }
  catch_signals();
  const auto refuse = [](const std::exception& error, int code) {
    std::fprintf(stderr, "hil run: %s\n", error.what());
    return code;
  };
  try {
    const run::SessionResult result = run::run_session(std::move(loaded->wiring), options, stop_requested);
    if (live) std::fputs("\r\033[K", stdout);
    report::write_report(result.record, options.directory);
    report::write_trace(result.trace, options.directory);
    std::fputs(report::report_text(result.record, options.directory.string()).c_str(), stdout);
    return result.record.exit_code;
  } catch (const run::GpuError& error) {
    return refuse(error, run::exit_gpu_failed);
  } catch (const io::DeviceError& error) {
    return refuse(error, run::exit_io_failed);
  } catch (const report::ReportError& error) {
    return refuse(error, run::exit_io_failed);
  } catch (const std::filesystem::filesystem_error& error) {
    return refuse(error, run::exit_io_failed);
  } catch (const modules::SetupError& error) {
    return refuse(error, run::exit_bad_config);
  }
}

}  // namespace

void add_run(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("run", "run a scenario");
  command->add_option("scenario", arguments->scenario, "the scenario's YAML file")->required();
  command->add_option("--duration", arguments->duration, "how long, with its unit: 10s");
  command->add_option("--clock", arguments->clock,
                      "realtime, or virtual: as fast as possible, the same results");
  command->add_option("--out", arguments->directory,
                      "folder for what the run leaves (default: out/<scenario>-<time>)");
  command->add_option("--set", arguments->overrides, "change a value of the scenario: path=value")
      ->take_all();
  command->add_option("--fail-on", arguments->fail_on,
                      "when the run counts as broken in its timing: 'misses > 0'");
  command->add_flag("--verbose,-v", arguments->verbose, "show on stderr what goes into run.log");
  CLI::Option* seed = command->add_option("--seed", arguments->seed, "seed of everything random");
  command->callback([arguments, seed, &exit_code] { exit_code = run(*arguments, seed->count() > 0); });
}

}  // namespace hil::cli
