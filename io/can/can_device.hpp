#pragma once
// A CAN bus as a device of the run: signals of messages in, signals of messages out. The contract is that of
// io/device.hpp.
//
// Inputs are, in this order: the counter of each sent message that has one ("EgoStatus.Counter", with the
// send instant as its time, so that a response time can be measured from it), then every signal of every
// received message ("BrakeCommand.Deceleration"). Outputs are every signal of every sent message except its
// counter and its checksum.
//
// Real time: one thread per device receives, stamps, decodes, encodes and sends. Lock-step: exchange() does
// that work.
//
// Threads: as in io/device.hpp; any thread may call counters(), fault() and enter_safe_state().

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "io/can/can_counters.hpp"
#include "io/can/can_transport.hpp"
#include "io/can/candump_log.hpp"
#include "io/can/dbc.hpp"
#include "io/can/frame_faults.hpp"
#include "io/can/log_playback.hpp"
#include "io/can/message_coder.hpp"
#include "io/can/send_order.hpp"
#include "io/device.hpp"
#include "io/frame_sink.hpp"
#include "io/handover/kept_arrivals.hpp"
#include "io/handover/latest_value.hpp"
#include "io/handover/timed_row_ring.hpp"

namespace hil::io::can {

struct SentMessageConfig {
  std::string message;
  std::int64_t period_ns = 0;  ///< 0: whenever outputs are released
  std::int64_t offset_ns = 0;  ///< run time of the first frame
  Protection protection;
  std::map<std::string, double> safe_values;  ///< by signal; missing ones are zero
};

struct ReceivedMessageConfig {
  std::string message;
  /// Without a frame for longer than this its inputs are not fresh and read their safe values; 0: never
  std::int64_t timeout_ns = 0;
  Protection protection;
  std::map<std::string, double> safe_values;  ///< by signal; missing ones are zero
};

struct CanDeviceConfig {
  std::string name;  ///< the name of the bus in the scenario
  Dbc database;
  /// Messages due in one tick are sent in this order.
  std::vector<SentMessageConfig> send;
  std::vector<ReceivedMessageConfig> receive;
  /// Frames of a log that the device sends, and receives as those of other stations. The frames have no
  /// identifier of a message under `send`.
  std::optional<PlaybackConfig> playback{};
  double bits_per_second = 500'000.0;  ///< for the bus load
  /// Frames that can not be sent while the bus is lost do not cause a send_fault()
  bool may_be_lost = false;
  std::filesystem::path log_file;  ///< candump -l format; empty: no log
  FrameSink* frames = nullptr;     ///< gets what the log gets; null: nothing does. Outlives the device
  std::function<void()>
      on_thread_start;  ///< called first in the device's thread (name, priority); may be empty
};

/// Every mistake in the configuration, one sentence each; empty: it is valid.
std::vector<std::string> configuration_problems(const CanDeviceConfig& config);

class CanDevice final : public Device, public ArrivalSource, public FaultTarget {
 public:
  /// Throws DeviceError with all configuration_problems() if there are any.
  CanDevice(CanDeviceConfig config, std::unique_ptr<CanTransport> bus);
  ~CanDevice() override;

  const std::string& name() const noexcept override { return config_.name; }
  std::span<const ChannelInfo> inputs() const noexcept override { return inputs_; }
  std::span<const ChannelInfo> outputs() const noexcept override { return outputs_; }
  std::span<const InputGroup> input_groups() const noexcept override { return groups_; }
  /// The shortest timeout of its received messages; 1 s if none has one.
  RunTimeNs loss_timeout_ns() const noexcept override { return loss_timeout_ns_; }

  SendCycle send_cycle(std::size_t output) const noexcept override;
  void start(const RunClock& clock, Pacing pacing) override;
  void latch_inputs(std::span<Sample> samples) noexcept override;
  /// Keeps up to max_kept_arrivals frames between two ticks; drops and counts newer ones.
  bool keep_arrivals(std::size_t input) override;
  std::optional<Arrival> next_arrival(std::span<InputValue> values) noexcept override;
  RejectedFrames rejected(std::size_t group) const noexcept override;
  std::uint64_t faulted_frames(std::size_t group) const noexcept override {
    return received_[received_of_group_[group]].counts->faulted.get();
  }
  std::uint64_t faulted_values(std::size_t input) const noexcept override;
  std::uint64_t lost_arrivals() const noexcept override { return arrivals_.lost(); }
  void release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept override;
  bool exchange(RunTimeNs tick_ns) override;
  /// In lock-step the safe values are sent by the next exchange() or by stop().
  void enter_safe_state() noexcept override;
  void stop() noexcept override;
  bool connected() const noexcept override { return connected_.load(std::memory_order_relaxed); }
  std::string fault() const override;
  /// A send queue that stays full for longer than loss_timeout_ns() is also a send fault.
  std::string send_fault() const override;

  ArrivalSource* arrival_source() noexcept override { return this; }
  FaultTarget* fault_target() noexcept override { return this; }

  /// Why frames of a message can not have the fault, as a clause; empty: they can. `message`: one that it
  /// sends or receives, named as in the DBC file or by identifier (identifier_text.hpp); or the identifier of
  /// played frames that no message of the DBC file has. Setup thread.
  std::string fault_problem(const std::string& message, const FrameFault& fault) const;
  // Before start: they add a fault, which is not active. The first one has number 0.
  /// Without a fault_problem().
  void add_fault(const std::string& message, std::unique_ptr<FrameFault> fault);
  /// It neither sends nor receives.
  void add_bus_off() { faults_.add_bus_off(); }
  /// Bus-off does.
  bool silences(std::size_t number) const noexcept override { return faults_.is_bus_off(number); }
  void set_fault(std::size_t number, bool active) noexcept override;
  std::uint64_t fault_count(std::size_t number) const noexcept override { return faults_.count(number); }
  std::uint64_t fault_effects(std::size_t number) const noexcept override { return faults_.effects(number); }
  std::optional<std::size_t> fault_stopped_by(std::size_t number) const noexcept override {
    return faults_.stopped_by(number);
  }
  void set_away(int process_group, bool away) override { bus_->set_away(process_group, away); }
  void note_interruption() noexcept override { interruptions_.fetch_add(1, std::memory_order_relaxed); }

  /// Begin and end of the playback.
  std::vector<DeviceEvent> events_since(std::size_t first) const override;

  CanCounters counters() const noexcept;
  /// Empty: there is no playback. After stop().
  std::optional<PlaybackState> playback() const {
    return playback_ ? std::optional(playback_->state()) : std::nullopt;
  }
  /// One entry per received message that had frames of another length, in the order of the configuration.
  std::vector<LengthCounts> other_lengths() const;
  /// One entry per received message that had rejected frames, in the order of the configuration.
  std::vector<RejectionCounts> rejections() const;
  /// Why the log lacks frames for another reason than a full queue (CandumpLogWriter::fault); complete after
  /// stop().
  std::string log_fault() const { return log_ ? log_->fault() : std::string(); }
  const CanTransport& bus() const noexcept { return *bus_; }

 private:
  struct Sent {
    std::string message;
    MessageEncoder encoder;
    std::int64_t period_ns;
    std::int64_t next_due_ns;
    std::vector<double> values;              ///< of every signal of the message
    std::vector<std::size_t> output_signal;  ///< signal index of each of the message's outputs
    std::size_t first_output;
    std::optional<std::size_t> counter_input;
    bool retry = false;  ///< its last frame met a full queue
  };
  struct ReceivedCounts {
    Count longer, shorter, bad_checksum, bad_counter, wrong_kind, rejected_by_scenario, faulted;
    std::vector<Count> faulted_values;  ///< by signal
  };
  struct Received {
    MessageDecoder decoder;
    MessageDecoder without_faults;  ///< checks all frames as the sender sent them
    std::size_t first_input;
    std::string message;
    std::unique_ptr<ReceivedCounts> counts = std::make_unique<ReceivedCounts>();
    std::uint64_t interruptions = 0;  ///< that the last frame knew of
  };
  struct Counts {
    Count rx, tx, played, errors, no_buffer, send_errors, bad_checksum, bad_counter, wrong_kind, unknown_id,
        saturated, refused_values, dropped_releases;
  };

  void add_sent(const SentMessageConfig& config);
  void add_received(const ReceivedMessageConfig& config);
  /// Throws DeviceError when a message is CAN FD and the open bus can not carry it.
  void require_fd_where_needed() const;

  void run();
  bool receive_up_to(std::size_t max_frames);
  void handle(const Frame& frame);
  /// Whether the frame, as it comes from the bus, would be rejected without the faults of the scenario.
  bool rejects_without_faults(Received& received, const Frame& frame) const noexcept;
  /// A fault of the scenario is why the values of a right frame do not come, or not yet, or are others.
  void note_faulted(Received& received, const Frame& frame) noexcept;
  /// After the faults of the message.
  void decode(Received& received, const Frame& frame);
  const MessageLayout* layout_of(const std::string& message) const;
  /// "; it sends or receives EgoStatus, BrakeCommand": the end of an error text. Empty: it has no messages.
  std::string other_messages() const;
  std::vector<PlayedFrame> played_frames(std::optional<canid_t> identifier) const;
  /// Begins or ends the bus-off of a fault. Inputs keep their values until their time-out.
  void update_injected_bus_off();
  void pass_due_frames();
  void play_due_frames();
  /// Faults of its identifier act on it here, unless they act where the device receives it back. Returns
  /// `sent` when a fault drops or holds the frame.
  SendResult play(const Frame& frame, RunTimeNs now_ns);
  SendResult put_played_on_bus(const Frame& frame, RunTimeNs now_ns);
  /// Whether the frame, received back by this station, was sent by the playback.
  bool is_played(const Frame& frame) const noexcept;
  /// `change`: a verb, "begins" or "ends".
  void note_event(RunTimeNs time_ns, const std::string& change);
  RunTimeNs now_ns() const noexcept {
    return pacing_ == Pacing::lockstep ? *last_tick_ns_ : clock_->now_ns();
  }
  void wait_for_work(bool more) noexcept;
  void store_input(std::size_t input, double value, RunTimeNs time_ns);
  void send_released();
  void send_due(std::span<const double> values, RunTimeNs tick_ns);
  void send_message(Sent& sent);
  SendResult put_on_bus(const Frame& frame, const std::string& message);
  void confirm(Sent& sent, RunTimeNs time_ns);
  void note_full_queue(RunTimeNs now_ns);
  /// `what` could not be sent: "message EgoStatus".
  void note_send_error(const std::string& what);
  void set_send_fault(const std::string& fault);
  void send_requested_safe_values();
  void publish_if_changed();
  void lose_inputs();
  /// Of all received messages: any next counter is accepted.
  void reset_counters();
  void update_bus_off(const Frame& frame);
  void set_health(bool connected, const std::string& fault);
  void wake() noexcept;

  CanDeviceConfig config_;
  std::unique_ptr<CanTransport> bus_;
  std::vector<ChannelInfo> inputs_;
  std::vector<ChannelInfo> outputs_;
  std::vector<InputGroup> groups_;
  RunTimeNs loss_timeout_ns_ = 0;
  std::vector<std::int64_t> input_timeout_ns_;
  std::vector<double> safe_outputs_;
  std::vector<Sent> sent_;
  std::vector<Received> received_;
  std::unordered_map<canid_t, std::size_t> received_by_id_;
  std::vector<std::size_t> received_of_group_;  ///< index into received_, by input group

  const RunClock* clock_ = nullptr;
  Pacing pacing_ = Pacing::realtime;
  std::atomic<bool> started_{false};
  std::unique_ptr<CandumpLogWriter> log_;
  std::unique_ptr<TimedRowRing> releases_;
  KeptArrivals arrivals_;
  std::vector<Sample> samples_;  ///< the device thread's copy
  bool samples_changed_ = false;
  std::unique_ptr<LatestValue<ValuesOfArrivals<std::vector<Sample>>>> published_;

  std::thread thread_;
  int wake_fd_ = -1;
  std::atomic<bool> stopping_{false};
  std::atomic<bool> safe_state_requested_{false};
  std::atomic<bool> connected_{false};
  bool bus_off_ = false;                    ///< the controller reported it and has not restarted since
  std::optional<RunTimeNs> full_since_ns_;  ///< since when the send queue has been full
  std::optional<RunTimeNs> last_tick_ns_;   ///< lock-step: of the last exchange

  std::optional<LogPlayback> playback_;
  std::set<canid_t> played_ids_;         ///< of the frames of the log
  std::set<canid_t> discontinuous_ids_;  ///< of the log, whose next frame need not continue the counter
  std::atomic<std::uint64_t> interruptions_{0};
  FrameFaults faults_;
  bool injected_bus_off_ = false;

  SendOrder send_order_;
  Counts counts_;
  BusLoadMeter load_;
  mutable std::mutex health_mutex_;  ///< protects fault_, send_fault_ and events_
  std::string fault_;
  std::string send_fault_;
  std::vector<DeviceEvent> events_;
};

}  // namespace hil::io::can
