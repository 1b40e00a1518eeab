#include <cstdio>

#include "runtime/cli/flush_output.hpp"
#include "runtime/cli/subcommands.hpp"
#include "runtime/report/report_files.hpp"
#include "runtime/report/report_json.hpp"
#include "runtime/report/report_text.hpp"
#include "runtime/run/run_folder.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {

void add_report(CLI::App& app, int& exit_code) {
  auto directory = std::make_shared<std::string>();
  CLI::App* command = app.add_subcommand(
      "report", "write report.html, junit.xml and the pictures again from a run's report.json");
  command->add_option("directory", *directory, "the folder of a run")->required();
  command->callback([directory, &exit_code] {
    try {
      const report::RunRecord record = report::load_report(*directory);
      run::require_no_links(*directory);
      report::remake_report(record, *directory);
      std::fputs(report::report_text(record, *directory).c_str(), stdout);
      exit_code = flush_output("report", run::exit_passed);
    } catch (const report::ReportError& error) {
      std::fprintf(stderr, "hil report: %s\n", error.what());
      exit_code = run::exit_io_failed;
    } catch (const io::DeviceError& error) {
      std::fprintf(stderr, "hil report: %s\n", error.what());
      exit_code = run::exit_io_failed;
    }
  });
}

}  // namespace hil::cli
