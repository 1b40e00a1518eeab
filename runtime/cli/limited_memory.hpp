#pragma once
// A GPU driver that gets no memory ends its process. Where the memory of a process is limited (ulimit -v,
// ulimit -d), work that opens a GPU therefore runs in a child process, and this process reports how the child
// ended.

#include <functional>
#include <string>

namespace hil::cli {

/// What to do about a lack of memory, as the end of a sentence: the limits of this process, or general
/// advice.
std::string memory_advice();

/// Whether the limits leave less memory than a GPU driver may need to open.
bool is_memory_scarce();

/// Without a limit, calls work() and returns its exit code. With a limit, calls it in a child process, to
/// which signals that end this process are passed on. When the child ends before work() returns, calls
/// `report_end` with how it ended, as "was ended by signal 6 (Aborted)", and returns the exit code of
/// `report_end`. Misuse: other threads run.
int run_within_limits(const std::function<int()>& work,
                      const std::function<int(const std::string& end)>& report_end);

}  // namespace hil::cli
