#pragma once
// The files that modules write while a run goes on (hil/file_stream.hpp), in its folder.
//
// Threads: open and close at setup and after the last tick; the streams as stated there.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <hil/file_stream.hpp>

namespace hil::run {

class RunFileStreams final : public modules::FileStreams {
 public:
  RunFileStreams(const std::filesystem::path& run_folder, bool virtual_clock);
  ~RunFileStreams() override;
  RunFileStreams(const RunFileStreams&) = delete;
  RunFileStreams& operator=(const RunFileStreams&) = delete;

  std::unique_ptr<modules::FileStream> open(const modules::FileStreamOptions& options) override;

  struct Shortfalls {
    std::vector<std::string> failures;  ///< a sentence for each reason why files are missing
    std::vector<std::string> limits;    ///< and for each stream that reached its largest size
  };
  /// Writes what was handed over. What streams hand over later is lost. Later calls return nothing.
  Shortfalls close();

 private:
  class Buffers;
  class Stream;
  void stop();
  void serve();

  const std::filesystem::path run_folder_;
  const bool virtual_clock_;
  std::vector<std::shared_ptr<Buffers>> streams_;  // constant while the thread runs
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hil::run
