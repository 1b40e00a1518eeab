#pragma once
// Why a run could not begin, sorted by what is to be done about it.

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

/// The program itself `end` ("was ended by signal 6 (Aborted)") where its memory is limited.
StartFailure failure_for_lack_of_memory(const std::string& end);

/// For commands that leave no report: that sentence on stderr. The exit code.
int report_lack_of_memory(const char* command, const std::string& end);

}  // namespace hil::cli
