#pragma once
// Why a run could not begin: verdict, exit code, and a sentence that states what to do.

#include <exception>
#include <filesystem>
#include <string>

#include "runtime/report/run_record.hpp"

namespace hil::cli {

struct StartFailure {
  report::Verdict verdict = report::Verdict::refused;
  int exit_code = 0;
  std::string sentence;  ///< what is wrong and what to do
};

/// `error` is what run::run_session threw for a run that writes into `directory`.
StartFailure start_failure_of(const std::exception& error, const std::filesystem::path& directory);

/// For a child process that ended because its memory is limited. `end`: how, as "was ended by signal 6
/// (Aborted)".
StartFailure failure_for_lack_of_memory(const std::string& end);

/// For commands that leave no report: prints the sentence of failure_for_lack_of_memory to stderr. Returns
/// the exit code.
int report_lack_of_memory(const char* command, const std::string& end);

}  // namespace hil::cli
