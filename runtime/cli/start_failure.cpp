#include "runtime/cli/start_failure.hpp"

#include <sys/resource.h>

#include <cstdio>
#include <new>
#include <system_error>

#include <hil/module.hpp>

#include "io/device.hpp"
#include "runtime/cli/limited_memory.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

using report::Verdict;

StartFailure lack_of_memory(const std::string& what) {
  return {Verdict::refused, run::exit_internal, "memory ran out: " + what + "; " + memory_advice()};
}

StartFailure gpu_failure(const std::string& sentence) {
  if (is_memory_scarce()) return lack_of_memory(sentence);
  return {Verdict::gpu_failed, run::exit_gpu_failed, sentence};
}

/// The first files of a run need more than this.
constexpr std::uint64_t small_disk_bytes = std::uint64_t{8} << 20;

/// When the disk is nearly full or files are limited: the limit and what to do. Else empty.
std::string disk_advice(const std::filesystem::path& directory) {
  std::error_code error;
  const std::uint64_t left = std::filesystem::space(directory, error).available;
  if (!error && left < small_disk_bytes) {
    return "; the disk of " + directory.string() + " has " + report::bytes_text(left) +
           " left: free space there, or choose another folder with --out";
  }
  rlimit largest{};
  getrlimit(RLIMIT_FSIZE, &largest);
  if (largest.rlim_cur >= small_disk_bytes) return {};
  return "; a file is limited to " + report::bytes_text(largest.rlim_cur) +
         " (ulimit -f): raise or remove the limit";
}

StartFailure io_failure(const std::string& sentence, const std::filesystem::path& directory) {
  const std::string memory = is_memory_scarce() ? "; memory may be the cause: " + memory_advice() : "";
  return {Verdict::io_failed, run::exit_io_failed, sentence + disk_advice(directory) + memory};
}

StartFailure setup_failure(const modules::SetupError& error, const std::filesystem::path& directory) {
  switch (error.fault()) {
    case modules::SetupError::Fault::memory:
      return lack_of_memory(error.what());
    case modules::SetupError::Fault::file:
      return io_failure(error.what(), directory);
    case modules::SetupError::Fault::device:
      return gpu_failure(error.what());
    case modules::SetupError::Fault::scenario:
      break;
  }
  return {Verdict::refused, run::exit_bad_config, error.what()};
}

}  // namespace

StartFailure start_failure_of(const std::exception& error, const std::filesystem::path& directory) {
  if (dynamic_cast<const run::MemoryError*>(&error) != nullptr) return lack_of_memory(error.what());
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr)
    return lack_of_memory("the run needs more than there is");
  if (dynamic_cast<const run::StoppedError*>(&error) != nullptr)
    return {Verdict::interrupted, run::exit_interrupted, error.what()};
  if (dynamic_cast<const run::GpuError*>(&error) != nullptr) return gpu_failure(error.what());
  if (dynamic_cast<const io::DeviceError*>(&error) != nullptr) return io_failure(error.what(), directory);
  if (const auto* setup = dynamic_cast<const modules::SetupError*>(&error))
    return setup_failure(*setup, directory);
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system != nullptr && (system->code() == std::errc::resource_unavailable_try_again ||
                            system->code() == std::errc::not_enough_memory))
    return lack_of_memory("the system refused a thread (" + std::string(error.what()) + ")");
  return {Verdict::refused, run::exit_internal, "internal fault: " + std::string(error.what())};
}

StartFailure failure_for_lack_of_memory(const std::string& end) {
  return lack_of_memory("the program " + end + ", which happens when a GPU driver gets no memory");
}

int report_lack_of_memory(const char* command, const std::string& end) {
  const StartFailure failure = failure_for_lack_of_memory(end);
  std::fprintf(stderr, "hil %s: %s\n", command, failure.sentence.c_str());
  return failure.exit_code;
}

}  // namespace hil::cli
