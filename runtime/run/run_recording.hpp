#pragma once
// The recording of a run: what the scenario selects, and its place in the record.
//
// Threads: the one that opens and closes the run.

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "runtime/recording/recorder.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/run_context.hpp"
#include "runtime/run/wiring.hpp"

namespace hil::run {

/// Null: the scenario records nothing. Throws io::DeviceError when the file can not be created.
std::unique_ptr<recording::Recorder> make_recorder(const Wiring& wiring, const RunContext& context);

/// Completes the recording with the events and misses of the record, after all devices are closed. Returns
/// why it is incomplete, a sentence each.
std::vector<std::string> close_recording(recording::Recorder& recorder,
                                         const std::filesystem::path& directory, report::RunRecord& record);

}  // namespace hil::run
