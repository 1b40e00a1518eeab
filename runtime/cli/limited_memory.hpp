#pragma once
// Where the memory of a process is limited (ulimit -v, ulimit -d), the driver of a GPU ends the process that
// it can get no memory in. Work that opens one runs in a child process then, and this process reports how the
// child ended.

#include <functional>
#include <string>

namespace hil::cli {

/// What to do about a lack of memory: the limits of this process as a sentence's end, or the general advice.
std::string memory_advice();

/// The limits leave less memory than the driver of a GPU takes to open.
bool is_memory_scarce();

/// Without a limit: work(). With one: work() in a child process, whose exit code is returned; signals that
/// end this process reach the child. A child that a signal or an exception ends is passed on to `report_end`
/// as "was ended by signal 6 (Aborted)", and its exit code is returned. Misuse: another thread runs.
int run_within_limits(const std::function<int()>& work,
                      const std::function<int(const std::string& end)>& report_end);

}  // namespace hil::cli
