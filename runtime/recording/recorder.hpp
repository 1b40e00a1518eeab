#pragma once
// The recording of a run. The tick and the threads of devices fill preallocated rings; an ordinary thread
// encodes and writes what they hold. When a ring is full, the message is dropped and counted; under the
// virtual clock the tick writes what full rings hold, so that none is dropped.
//
// A message of signals is recorded on each tick on which their writer wrote one of them, or one of them
// became unknown. Its time is that of the tick. Frames have the time at which they were on the bus; what was
// before the first tick has the time 0. Messages of one topic are in the order of their times.
//
// Threads: take on the base thread; each frame sink on the thread of its device; the rest on the thread that
// opens and closes the run.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "io/frame_sink.hpp"
#include "runtime/contribution/frame_format.hpp"
#include "runtime/recording/mcap_writer.hpp"
#include "runtime/recording/topics.hpp"
#include "runtime/recording/value_ring.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::recording {

/// A bus whose frames are recorded.
struct RecordedBus {
  std::string name;  ///< full name: "can.car"
  contribution::FrameFormat format;
};

struct RecorderOptions {
  std::filesystem::path file;
  std::uint64_t max_bytes = 0;  ///< at least min_bytes
  bool virtual_clock = false;
  std::vector<RecordedBus> frame_buses;
  McapMetadata about_run;
};

struct RecordedEvent {
  std::int64_t time_ns = 0;
  std::string text;
};

struct RecordedMiss {
  std::int64_t time_ns = 0;  ///< of the release
  std::string task;
  std::uint64_t tick = 0;
  std::string cause;
  std::int64_t lateness_ns = 0;
};

struct RecordingResult {
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;                 ///< in the file
  std::uint64_t dropped = 0;                  ///< since a ring was full
  std::optional<std::int64_t> stopped_at_ns;  ///< time of the first message that the size limit refused
  std::uint64_t not_recorded = 0;             ///< messages that it refused
  std::string fault;                          ///< why the file is incomplete, in a sentence; empty: it is not
};

class Recorder {
 public:
  static constexpr std::uint64_t min_bytes = std::uint64_t{1} << 20;

  /// Throws io::DeviceError when the file can not be created, or when the topics do not fit into it.
  Recorder(RecorderOptions options, const signals::SignalTable& table,
           std::span<const signals::SignalId> signals);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// For the frames of one of frame_buses; null for another bus.
  io::FrameSink* frame_sink(const std::string& bus) noexcept;

  /// At the end of each tick. Under the real-time clock it neither blocks nor allocates nor does file I/O.
  void take(const signals::SignalTable& table, std::int64_t time_ns) noexcept;

  /// After the last tick, when all devices are stopped: writes the rest and completes the file. Called once.
  RecordingResult close(std::span<const RecordedEvent> events, std::span<const RecordedMiss> misses);

 private:
  struct Topic;
  class FrameRing;
  struct Late {
    std::int64_t time_ns = 0;
    std::uint16_t channel = 0;
    std::string text;
  };

  [[noreturn]] void refuse() const;
  std::uint16_t added(const McapTopic& topic);
  void serve();
  void drain();
  void write_values();
  void write(std::uint16_t channel, std::int64_t time_ns, std::string_view text, std::uint64_t limit);

  const RecorderOptions options_;
  const std::uint64_t event_limit_;  ///< bytes of the file that messages may fill
  const std::uint64_t tick_limit_;   ///< the same for those of ticks and buses: less, so that events fit
  McapWriter writer_;
  std::vector<Topic> topics_;
  std::unique_ptr<ValueRing> values_;
  std::vector<std::unique_ptr<FrameRing>> frames_;
  std::uint16_t events_ = 0, misses_ = 0;  ///< channels

  std::atomic<std::uint64_t> dropped_{0};  ///< messages of signals
  std::optional<std::int64_t> stopped_at_ns_;
  std::uint64_t not_recorded_ = 0;
  std::string text_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hil::recording
