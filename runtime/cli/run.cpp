#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <optional>

#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/limited_memory.hpp"
#include "runtime/cli/load.hpp"
#include "runtime/cli/start_failure.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/report/report_files.hpp"
#include "runtime/report/report_json.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/run_folder.hpp"
#include "runtime/run/run_log.hpp"
#include "runtime/run/session.hpp"
#include "runtime/run/step_guard.hpp"

namespace hil::cli {
namespace {

std::atomic<bool> stop_requested{false};

/// The first SIGINT, SIGTERM or SIGHUP (the terminal was closed, without nohup) ends the run in order; the
/// second one ends the program.
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
  struct sigaction before {};
  if (sigaction(SIGHUP, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
    sigaction(SIGHUP, &action, nullptr);
  // A closed console or a file beyond its permitted size must not kill the run, which has to set its outputs
  // to their safe values. Writing fails instead, and the run reports it.
  run::report_signals_of_steps();
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

struct Arguments {
  std::string scenario;
  std::vector<std::string> overrides, additions;
  std::string duration, clock, seed, directory;
  std::optional<std::string> fail_on;
  bool verbose = false;
};

/// The overrides of --add and --set, then those of --duration, --clock and --seed.
std::vector<std::string> all_overrides(const Arguments& arguments, bool seed_given) {
  std::vector<std::string> overrides = with_additions(arguments.additions, arguments.overrides);
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
  // Two runs that begin in the same second must not share a folder.
  std::filesystem::path directory = base;
  for (int i = 2; std::filesystem::exists(directory); ++i)
    directory = base.string() + "-" + std::to_string(i);
  return directory;
}

constexpr std::size_t columns_of_log = 200;

std::size_t terminal_columns() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/// Writes the report, then the trace, which is large. When a file can not be written, the run fails and no
/// file in the folder says that it passed. Returns whether there is a report.
bool write_files(run::SessionResult& result, const std::filesystem::path& directory) {
  report::RunRecord& record = result.record;
  try {
    report::write_report(record, directory);
    if (result.trace) report::write_trace(*result.trace, directory);
    return true;
  } catch (const report::ReportError& error) {
    std::fprintf(stderr, "hil run: %s\n", error.what());
    if (record.exit_code != run::exit_gpu_failed) {
      record.reason = std::string(error.what()) + " (before that: " + report::reason_sentence(record) + ")";
      record.verdict = report::Verdict::io_failed;
      record.exit_code = run::exit_io_failed;
    }
  }
  std::error_code ignored;
  for (const char* file : {"report.json", "junit.xml", "report.html", "trace.json"})
    std::filesystem::remove(directory / file, ignored);
  try {
    report::write_report(record, directory);
  } catch (const report::ReportError&) {
    // The first failure is reported above. write_report writes small files first.
  }
  return std::filesystem::exists(directory / "report.json", ignored);
}

void note_exit_code(const run::SessionOptions& options, bool to_console, const std::string& sentence) {
  try {
    run::RunLog(options.directory / "run.log", to_console, false).info(sentence);
  } catch (const io::DeviceError& error) {
    std::fprintf(stderr, "hil run: %s\n", error.what());
  }
}

/// Writes the report's files and prints its text. Returns the exit code of the run, or of a failed output.
int write_and_print_report(run::SessionResult& result, const run::SessionOptions& options) {
  const report::RunRecord& record = result.record;
  const bool is_there = write_files(result, options.directory);
  std::fputs(report::report_text(record, is_there ? options.directory.string() : "").c_str(), stdout);
  const int exit_code = flush_output("run", record.exit_code);
  note_exit_code(options, options.verbose, "exit code " + std::to_string(exit_code) + ": " + record.reason);
  return exit_code;
}

/// Writes the report of a run that did not begin. The reason is printed once, on stderr.
int write_report_of_failed_start(const config::Scenario& scenario, const run::SessionOptions& options,
                                 const StartFailure& failure) {
  std::fprintf(stderr, "hil run: %s\n", failure.sentence.c_str());
  run::SessionResult result;
  result.record =
      run::record_of_refusal(scenario, options, failure.verdict, failure.exit_code, failure.sentence);
  const bool is_there = write_files(result, options.directory);
  std::printf("%s: the reason is on stderr%s\n", report::headline(failure.verdict),
              is_there ? (" and in the report in " + options.directory.string()).c_str()
                       : ", and there is no report");
  const int exit_code = flush_output("run", result.record.exit_code);
  note_exit_code(
      options, false,
      "the run can not begin: " + failure.sentence + " (exit code " + std::to_string(exit_code) + ")");
  return exit_code;
}

int run_in_folder(Loaded& loaded, const run::SessionOptions& options, const run::RunFolder& folder,
                  bool live) {
  run::SessionResult result;
  std::optional<StartFailure> failure;
  try {
    folder.clear();
    result = run::run_session(std::move(loaded.wiring), options, stop_requested);
    if (live) std::fputs("\r\033[K", stdout);
  } catch (const std::exception& error) {
    failure = start_failure_of(error, options.directory);
  }
  return failure ? write_report_of_failed_start(*loaded.scenario, options, *failure)
                 : write_and_print_report(result, options);
}

/// Leaves junit.xml with the mistakes in the folder in place of the reports of an earlier run, so that those
/// are not taken for this one's. The recorded world of that run stays: a mistake in the arguments must not
/// delete a history. `directory` is empty when the arguments name none.
int refuse_run(const std::string& directory, const std::string& scenario, const std::string& mistakes) {
  if (directory.empty()) return run::exit_bad_config;
  const std::string name = std::filesystem::path(scenario).stem().string();
  try {
    const run::RunFolder folder(directory);
    folder.clear_reports();
    report::write_refusal_junit(name.empty() ? "run" : name, mistakes, directory);
  } catch (const std::runtime_error& error) {  // of a device or a report
    std::fprintf(stderr, "hil run: %s\n", error.what());
  }
  return run::exit_bad_config;
}

int run(const Arguments& arguments, bool seed_given) {
  const std::vector<std::string> overrides = all_overrides(arguments, seed_given);
  run::SessionOptions options;
  const auto refuse = [&](const std::string& mistakes) {
    return refuse_run(arguments.directory, arguments.scenario, mistakes);
  };
  if (arguments.fail_on) {
    config::Diagnostics diagnostics;
    options.fail_on = run::parse_fail_on(*arguments.fail_on, diagnostics);
    if (!options.fail_on) {
      std::fputs(diagnostics.to_text().c_str(), stderr);
      return refuse(diagnostics.to_text());
    }
  }
  std::string mistakes;
  auto loaded = load(arguments.scenario, overrides, &mistakes);
  if (!loaded) return refuse(mistakes);
  options.directory = arguments.directory.empty() ? default_directory(arguments.scenario)
                                                  : std::filesystem::path(arguments.directory);
  options.overrides = as_pairs(overrides);
  options.verbose = arguments.verbose;
  options.program_folders = {program_folder()};
  const bool live = isatty(STDOUT_FILENO) != 0;
  if (live) {
    options.every_second = [](const report::LiveStatus& status) {
      std::printf("\r\033[K%s", report::live_line(status, terminal_columns() - 1).c_str());
      std::fflush(stdout);
    };
  } else {
    options.announces_begin = true;
    options.every_second = [seconds = 0](const report::LiveStatus& status) mutable {
      if (++seconds % 60 == 0)
        std::fprintf(stderr, "hil run: %s\n", report::live_line(status, columns_of_log).c_str());
    };
  }
  catch_signals();
  try {
    const run::RunFolder folder(options.directory);
    return run_within_limits([&] { return run_in_folder(*loaded, options, folder, live); },
                             [&](const std::string& end) {
                               return write_report_of_failed_start(*loaded->scenario, options,
                                                                   failure_for_lack_of_memory(end));
                             });
  } catch (const io::DeviceError& error) {
    std::fprintf(stderr, "hil run: %s\n", error.what());
    return run::exit_io_failed;
  }
}

}  // namespace

int refuse_arguments(const CLI::App& app, const std::string& mistake) {
  const CLI::App* const run = app.get_subcommand("run");
  const auto value_of = [&](const std::string& option) {
    const std::vector<std::string>& values = run->get_option(option)->results();
    return values.empty() ? std::string() : values.front();
  };
  if (run->count_all() == 0) return run::exit_bad_config;
  return refuse_run(value_of("--out"), value_of("scenario"), mistake);
}

void add_run(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("run", "run a scenario");
  command->add_option("scenario", arguments->scenario, "the scenario's YAML file")->required();
  command->add_option("--duration", arguments->duration,
                      "run time at which the run ends, with its unit: 10s");
  command->add_option("--clock", arguments->clock, "realtime, or virtual: as fast as possible");
  command->add_option("--out", arguments->directory, "folder of the run (default: out/<file>-<time>)");
  command
      ->add_option("--set", arguments->overrides,
                   "change a value of the scenario: path=value; may be repeated")
      ->take_all();
  command
      ->add_option("--add", arguments->additions,
                   "add a name that the scenario defines itself, as a variable or an output of a block: "
                   "path=value; may be repeated")
      ->take_all();
  command->add_option("--fail-on", arguments->fail_on, "exit with 3 when this condition holds: 'misses > 0'");
  command->add_flag("--verbose,-v", arguments->verbose, "print run.log to stderr too");
  CLI::Option* seed = command->add_option("--seed", arguments->seed, "seed of all random numbers");
  command->callback([arguments, seed, &exit_code] { exit_code = run(*arguments, seed->count() > 0); });
}

}  // namespace hil::cli
