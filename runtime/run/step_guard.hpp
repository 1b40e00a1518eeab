#pragma once
// What a run does about modules that fail: a step that throws, and a signal inside a step.
//
// Threads: StepGuard in the step; the rest before a run, one thread.

#include <string>

namespace hil::run {

/// While it exists, a signal of this thread that would end the program (as SIGSEGV) is reported on stderr
/// with the name of the module. `module`: "module pump (plug-in pumps)"; outlives it.
class StepGuard {
 public:
  explicit StepGuard(const std::string& module) noexcept;
  ~StepGuard();
  StepGuard(const StepGuard&) = delete;
  StepGuard& operator=(const StepGuard&) = delete;
};

/// Installs the handlers of those signals. They end the program as without a handler.
void report_signals_of_steps();

/// The text of the exception that is being handled.
std::string text_of_exception() noexcept;

/// "module pump", of a plug-in "module pump (plug-in pumps)".
std::string name_with_plugin(const std::string& module, const std::string& type);

}  // namespace hil::run
