#include "io/can/can_device.hpp"

#include <linux/can/error.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "io/can/bus_frame.hpp"

namespace hil::io::can {

namespace {

constexpr std::size_t ring_rows = 64;           // ticks whose outputs may be queued for the thread
constexpr std::size_t frames_per_pass = 256;    // received before outputs are processed again
constexpr std::size_t frames_at_end = 100'000;  // received at most while stopping
constexpr RunTimeNs default_loss_timeout_ns = 1'000'000'000;
constexpr RunTimeNs poll_limit_ns = 20'000'000;  // the thread tries to reopen a lost bus this often

std::string joined(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences)
    text += (text.empty() ? "" : "\n") + sentence;
  return text;
}

BusFrame recorded(const Frame& frame, const RunClock& clock) {
  BusFrame all{.time_ns = clock.to_run_time(frame.time_ns),
               .id = frame.is_error() ? frame.raw.can_id & CAN_ERR_MASK : frame.identifier(),
               .extended = !frame.is_error() && frame.is_extended(),
               .fd = frame.is_fd,
               .remote = frame.is_remote(),
               .error = frame.is_error(),
               .sent = frame.direction == Direction::tx,
               .size = frame.raw.len};
  if (!frame.is_remote()) std::ranges::copy(frame.payload(), all.data.begin());
  return all;
}

}  // namespace

CanDevice::CanDevice(CanDeviceConfig config, std::unique_ptr<CanTransport> bus)
    : config_(std::move(config)), bus_(std::move(bus)), load_(config_.bits_per_second) {
  require(bus_ != nullptr, "a CAN device has a bus");
  const std::vector<std::string> problems = configuration_problems(config_);
  if (!problems.empty()) throw DeviceError(joined(problems));
  for (const SentMessageConfig& sent : config_.send)
    add_sent(sent);
  for (const ReceivedMessageConfig& received : config_.receive)
    add_received(received);
  for (const InputGroup& group : groups_) {
    if (group.timeout_ns > 0 && (loss_timeout_ns_ == 0 || group.timeout_ns < loss_timeout_ns_))
      loss_timeout_ns_ = group.timeout_ns;
  }
  if (loss_timeout_ns_ == 0) loss_timeout_ns_ = default_loss_timeout_ns;
  samples_.resize(inputs_.size());
  lose_inputs();
  published_ = std::make_unique<LatestValue<ValuesOfArrivals<std::vector<Sample>>>>(
      ValuesOfArrivals<std::vector<Sample>>{.values = samples_});
  if (config_.playback) {
    playback_.emplace(*config_.playback);
    for (const PlayedFrame& frame : *config_.playback->frames)
      played_ids_.insert(frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK));
  }
  releases_ = std::make_unique<TimedRowRing>(ring_rows, outputs_.size());
}

CanDevice::~CanDevice() {
  stop();
  if (wake_fd_ >= 0) ::close(wake_fd_);
}

SendCycle CanDevice::send_cycle(std::size_t output) const noexcept {
  for (std::size_t i = 0; i < sent_.size(); ++i) {
    const std::size_t first = sent_[i].first_output;
    if (output >= first && output - first < sent_[i].output_signal.size())
      return {config_.send[i].period_ns, config_.send[i].offset_ns};
  }
  return {};
}

void CanDevice::start(const RunClock& clock, Pacing pacing) {
  require(!started_ && wake_fd_ < 0, "a CAN device is started once");
  wake_fd_ = ::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  if (wake_fd_ < 0) {
    throw DeviceError("CAN bus '" + config_.name + "' can not be started: eventfd: " + std::strerror(errno));
  }
  clock_ = &clock;
  pacing_ = pacing;
  bus_->open(clock, pacing);
  require_fd_where_needed();
  if (!config_.log_file.empty()) {
    const auto when_full =
        pacing == Pacing::lockstep ? CandumpLogWriter::WhenFull::wait : CandumpLogWriter::WhenFull::drop;
    log_ = std::make_unique<CandumpLogWriter>(config_.log_file, bus_->name(), when_full);
  }
  started_ = true;
  set_health(true, {});
  if (pacing == Pacing::realtime) thread_ = std::thread([this] { run(); });
}

void CanDevice::require_fd_where_needed() const {
  const std::string problem = bus_->fd_problem();
  if (problem.empty()) return;
  const auto refuse = [&](bool is_fd, const std::string& message) {
    if (is_fd)
      throw DeviceError("CAN bus '" + config_.name + "': message '" + message +
                        "' is a CAN FD message, but " + problem);
  };
  for (std::size_t index = 0; index < sent_.size(); ++index)
    refuse(sent_[index].encoder.layout().is_fd(), config_.send[index].message);
  for (const Received& received : received_)
    refuse(received.decoder.layout().is_fd(), received.message);
  if (playback_ && std::ranges::any_of(*config_.playback->frames, &PlayedFrame::is_fd)) {
    throw DeviceError("CAN bus '" + config_.name + "': the log " + config_.playback->name +
                      " has CAN FD frames, but " + problem);
  }
}

void CanDevice::stop() noexcept {
  if (!started_) return;
  if (thread_.joinable()) {  // false if the system refused to create the thread
    stopping_.store(true, std::memory_order_release);
    wake();
    thread_.join();
  } else if (last_tick_ns_) {
    exchange(*last_tick_ns_);  // sends safe values even if a station is lost
  }
  started_ = false;
  arrivals_.latch_all();
  bus_->close();
  if (log_) log_->close();
  set_health(false, fault());
}

void CanDevice::latch_inputs(std::span<Sample> samples) noexcept {
  require(samples.size() == inputs_.size(), "one sample per input");
  published_->take_newest();
  arrivals_.latch(published_->current().arrivals);
  const std::vector<Sample>& newest = published_->current().values;
  const RunTimeNs now_ns = clock_ == nullptr ? 0 : clock_->now_ns();
  for (std::size_t input = 0; input < samples.size(); ++input) {
    samples[input] = newest[input];
    if (clock_ != nullptr) samples[input].time_ns = clock_->to_run_time(samples[input].time_ns);
    const std::int64_t timeout_ns = input_timeout_ns_[input];
    if (samples[input].fresh && timeout_ns > 0 && now_ns - samples[input].time_ns > timeout_ns) {
      samples[input].value = inputs_[input].safe_value;
      samples[input].fresh = false;
    }
  }
}

bool CanDevice::keep_arrivals(std::size_t input) {
  require(!started_ && input < inputs_.size(), "arrivals of an input are kept from before the start on");
  const auto group = std::ranges::find_if(groups_, [&](const InputGroup& candidate) {
    return input >= candidate.first && input < candidate.first + candidate.count;
  });
  const std::size_t first = group == groups_.end() ? input : group->first;
  const std::size_t count = group == groups_.end() ? 1 : group->count;
  arrivals_.keep(first, count, count);
  return true;
}

std::optional<Arrival> CanDevice::next_arrival(std::span<InputValue> values) noexcept {
  require(values.size() == inputs_.size(), "a value per input");
  std::optional<Arrival> arrival = arrivals_.take(values);
  if (arrival) arrival->time_ns = clock_->to_run_time(arrival->time_ns);
  return arrival;
}

void CanDevice::release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept {
  require(values.size() == outputs_.size(), "one value per output");
  if (!releases_->push(values, tick_ns)) {
    counts_.dropped_releases.add();
    return;
  }
  if (pacing_ == Pacing::realtime) wake();
}

bool CanDevice::exchange(RunTimeNs tick_ns) {
  require(started_ && pacing_ == Pacing::lockstep, "exchange belongs to a started device in lock-step");
  last_tick_ns_ = tick_ns;
  update_injected_bus_off();
  pass_due_frames();
  play_due_frames();
  send_released();
  send_requested_safe_values();
  const ExchangeResult result = bus_->exchange(tick_ns);
  while (receive_up_to(frames_per_pass)) {
  }
  load_.advance(tick_ns);
  publish_if_changed();
  if (!result.completed()) set_health(false, bus_->fault());
  return result.completed();
}

void CanDevice::enter_safe_state() noexcept {
  safe_state_requested_.store(true, std::memory_order_release);
  if (started_ && pacing_ == Pacing::realtime) wake();
}

std::string CanDevice::fault() const {
  const std::lock_guard lock(health_mutex_);
  return fault_;
}

std::string CanDevice::send_fault() const {
  const std::lock_guard lock(health_mutex_);
  return send_fault_;
}

void CanDevice::run() {
  if (config_.on_thread_start) config_.on_thread_start();
  while (true) {
    const bool last_pass = stopping_.load(std::memory_order_acquire);
    update_injected_bus_off();
    bool more = receive_up_to(frames_per_pass);
    pass_due_frames();
    play_due_frames();
    send_released();
    send_requested_safe_values();
    more = receive_up_to(last_pass ? frames_at_end : frames_per_pass) || more;
    load_.advance(clock_->now_ns());
    publish_if_changed();
    if (last_pass) return;
    wait_for_work(more);
  }
}

void CanDevice::wait_for_work(bool more) noexcept {
  RunTimeNs left_ns = more ? 0 : poll_limit_ns;
  for (const auto due_ns : {faults_.next_due_ns(), playback_ ? playback_->next_due_ns() : std::nullopt})
    if (due_ns) left_ns = std::clamp<RunTimeNs>(*due_ns - clock_->now_ns(), 0, left_ns);
  const timespec limit{0, left_ns};
  std::array<pollfd, 2> watched{pollfd{bus_->fd(), POLLIN, 0}, pollfd{wake_fd_, POLLIN, 0}};
  static_cast<void>(::ppoll(watched.data(), watched.size(), &limit, nullptr));
  std::uint64_t wakes = 0;
  static_cast<void>(::read(wake_fd_, &wakes, sizeof wakes));
}

// True when it stopped at the limit.
bool CanDevice::receive_up_to(std::size_t max_frames) {
  Frame frame;
  for (std::size_t count = 0; count < max_frames; ++count) {
    switch (bus_->receive(frame)) {
      case ReceiveResult::frame:
        handle(frame);
        break;
      case ReceiveResult::empty:
        if (!connected() && !bus_off_ && !injected_bus_off_ && pacing_ == Pacing::realtime)
          set_health(true, {});
        return false;
      case ReceiveResult::lost:
        if (connected()) lose_inputs();
        bus_off_ = false;  // the interface is opened anew
        set_health(false, bus_->fault());
        return false;
    }
  }
  return true;
}

void CanDevice::handle(const Frame& frame) {
  if (injected_bus_off_ && !frame.is_error()) return faults_.note_blocked_frame(frame.raw.can_id);
  if (log_) log_->push(frame);
  if (config_.frames != nullptr) {
    const BusFrame on_bus = recorded(frame, *clock_);
    take_frame(*config_.frames, on_bus.time_ns, on_bus);
  }
  load_.add(frame);
  if (frame.is_error()) counts_.errors.add();
  update_bus_off(frame);
  if (frame.is_error()) return;
  Frame received_frame = frame;
  if (frame.direction == Direction::rx) {
    counts_.rx.add();
  } else if (is_played(frame)) {
    received_frame.direction = Direction::rx;
  } else {
    return send_order_.received_back(frame.raw.can_id);
  }
  const auto found = received_by_id_.find(frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK));
  if (found == received_by_id_.end()) return counts_.unknown_id.add();
  Received& received = received_[found->second];
  received_frame.is_sender_wrong = rejects_without_faults(received, frame);
  const std::span<const Frame> passed = faults_.pass(received_frame, now_ns());
  for (const Frame& passed_frame : passed)
    decode(received, passed_frame);
  const bool is_held = passed.empty();  // or dropped
  if (is_held || std::ranges::any_of(passed, &Frame::is_altered)) note_faulted(received, received_frame);
}

void CanDevice::note_faulted(Received& received, const Frame& frame) noexcept {
  if (frame.is_sender_wrong) return;
  received.counts->faulted.add();
  received.decoder.decode(frame,
                          [&](std::size_t signal, double) { received.counts->faulted_values[signal].add(); });
}

bool CanDevice::rejects_without_faults(Received& received, const Frame& frame) const noexcept {
  MessageDecoder& decoder = received.without_faults;
  const std::uint64_t interruptions = interruptions_.load(std::memory_order_relaxed);
  const bool is_interrupted = std::exchange(received.interruptions, interruptions) != interruptions;
  if (is_interrupted || frame.is_discontinuous) decoder.reset_counter();
  if (frame.is_altered) {  // by the bus, so that its content is not known
    decoder.note_unknown_counter();
    return false;
  }
  return decoder.check(frame) != MessageDecoder::Verdict::accepted;
}

void CanDevice::decode(Received& received, const Frame& frame) {
  using Verdict = MessageDecoder::Verdict;
  const Verdict verdict = received.decoder.check(frame);
  const bool is_rejected = verdict != Verdict::accepted;
  ReceivedCounts& counts = *received.counts;
  if (is_rejected) note_faulted(received, frame);
  if (is_rejected && !frame.is_sender_wrong) counts.rejected_by_scenario.add();
  switch (verdict) {
    case Verdict::wrong_kind:
      counts.wrong_kind.add();
      return counts_.wrong_kind.add();
    case Verdict::bad_checksum:
      counts.bad_checksum.add();
      return counts_.bad_checksum.add();
    case Verdict::bad_counter:
      counts.bad_counter.add();
      return counts_.bad_counter.add();
    case Verdict::accepted:
      break;
  }
  const std::size_t length = received.decoder.layout().frame_length();
  if (frame.raw.len > length) counts.longer.add();
  if (frame.raw.len < length) counts.shorter.add();
  const RunTimeNs time_ns = std::max(frame.time_ns, send_order_.earliest_ns());
  received.decoder.decode(frame, [&](std::size_t signal, double value) {
    store_input(received.first_input + signal, value, time_ns);
  });
  arrivals_.complete(time_ns);
}

void CanDevice::pass_due_frames() {
  if (!faults_.next_due_ns()) return;
  for (const Frame& frame : faults_.take_due(now_ns())) {
    if (injected_bus_off_) {
      faults_.note_blocked_frame(frame.raw.can_id);
      continue;
    }
    if (frame.direction == Direction::tx) {
      const auto sent = std::ranges::find(sent_, frame.raw.can_id,
                                          [](const Sent& one) { return one.encoder.layout().can_id(); });
      if (sent == sent_.end())
        put_played_on_bus(frame, now_ns());
      else
        put_on_bus(frame, sent->message);
    } else {
      decode(received_[received_by_id_.at(frame.raw.can_id & (CAN_EFF_FLAG | CAN_EFF_MASK))], frame);
    }
  }
}

void CanDevice::update_injected_bus_off() {
  const bool is_off = faults_.is_bus_off();
  if (is_off == injected_bus_off_) return;
  injected_bus_off_ = is_off;
  if (is_off) reset_counters();
  if (bus_off_) return;  // its controller is bus-off as well, and says so
  set_health(!is_off, is_off ? "CAN bus '" + config_.name + "' is bus-off by a fault of the scenario" : "");
}

void CanDevice::set_fault(std::size_t number, bool active) noexcept {
  faults_.set(number, active);
  if (started_ && pacing_ == Pacing::realtime) wake();
}

/// A bus-off controller neither sends nor receives until it is restarted.
void CanDevice::update_bus_off(const Frame& frame) {
  if (frame.is_error() && (frame.raw.can_id & CAN_ERR_BUSOFF) != 0) {
    if (connected()) lose_inputs();
    bus_off_ = true;
    set_health(false, "CAN bus '" + config_.name + "' (" + bus_->description() +
                          ") is bus-off: its controller has seen too many errors; it comes back when it is "
                          "restarted ('ip link set " +
                          bus_->name() + " type can restart-ms 100')");
    return;
  }
  const bool restarted = frame.is_error() && (frame.raw.can_id & CAN_ERR_RESTARTED) != 0;
  if (!bus_off_ || (frame.is_error() && !restarted)) return;
  bus_off_ = false;
  set_health(true, {});
}

void CanDevice::store_input(std::size_t input, double value, RunTimeNs time_ns) {
  samples_[input] = {value, time_ns, true};
  samples_changed_ = true;
  arrivals_.add(input, value);
}

void CanDevice::send_released() {
  while (releases_->take(
      [this](std::span<const double> values, RunTimeNs tick_ns) { send_due(values, tick_ns); })) {
  }
}

void CanDevice::send_due(std::span<const double> values, RunTimeNs tick_ns) {
  for (Sent& sent : sent_) {
    const bool due = sent.next_due_ns <= tick_ns;
    if (!due && !sent.retry) continue;
    if (due && sent.period_ns > 0) {
      sent.next_due_ns += ((tick_ns - sent.next_due_ns) / sent.period_ns + 1) * sent.period_ns;
    }
    for (std::size_t output = 0; output < sent.output_signal.size(); ++output) {
      sent.values[sent.output_signal[output]] = values[sent.first_output + output];
    }
    sent.retry = due;  // a frame that is not due is being retried, for the last time
    send_message(sent);
  }
}

void CanDevice::send_message(Sent& sent) {
  if (injected_bus_off_) {
    sent.retry = false;
    return faults_.note_blocked_frame(sent.encoder.layout().can_id());
  }
  MessageEncoder::Tally tally;
  const Frame frame = sent.encoder.build(sent.values, tally);
  counts_.saturated.add(tally.saturated);
  counts_.refused_values.add(tally.refused);
  const RunTimeNs send_ns = now_ns();
  SendResult first = SendResult::sent;  // also of a frame that a fault holds or drops
  bool is_first = true;
  for (const Frame& passed : faults_.pass(frame, send_ns)) {
    const SendResult result = put_on_bus(passed, sent.message);
    if (std::exchange(is_first, false)) first = result;
  }
  if (first == SendResult::sent) return confirm(sent, send_ns);
  if (first == SendResult::error) sent.retry = false;
}

/// Counts the result, and notes what makes a send fault.
SendResult CanDevice::put_on_bus(const Frame& frame, const std::string& message) {
  const RunTimeNs send_ns = now_ns();
  const SendResult result = bus_->send(frame);
  switch (result) {
    case SendResult::sent:
      counts_.tx.add();
      full_since_ns_.reset();
      send_order_.sent(frame.raw.can_id, send_ns);
      break;
    case SendResult::no_buffer:
      counts_.no_buffer.add();
      note_full_queue(send_ns);
      break;
    case SendResult::error:
      counts_.send_errors.add();
      note_send_error("message " + message);
      break;
  }
  return result;
}

/// The last built frame of the message is on its way.
void CanDevice::confirm(Sent& sent, RunTimeNs time_ns) {
  sent.retry = false;
  const std::uint64_t counter = sent.encoder.confirm_sent();
  if (!sent.counter_input) return;
  const double value = sent.encoder.layout().codec(*sent.encoder.layout().counter()).to_physical(counter);
  store_input(*sent.counter_input, value, time_ns);
  arrivals_.complete(time_ns);
}

void CanDevice::note_full_queue(RunTimeNs now_ns) {
  if (!full_since_ns_) full_since_ns_ = now_ns;
  if (now_ns - *full_since_ns_ <= loss_timeout_ns_) return;
  set_send_fault("CAN bus '" + config_.name + "' (" + bus_->description() + ") took no frame for more than " +
                 std::to_string(loss_timeout_ns_ / 1'000'000) +
                 " ms: its queue stays full, since no other station acknowledges frames");
}

void CanDevice::note_send_error(const std::string& what) {
  const int error = bus_->send_error();
  const bool lost = error == ENETDOWN || error == ENODEV || error == ENXIO || error == ENOTCONN;
  if (lost && config_.may_be_lost) return;
  set_send_fault(what + " could not be sent on CAN bus '" + config_.name + "' (" + bus_->description() +
                 "): " + std::strerror(error));
}

/// Keeps the first fault.
void CanDevice::set_send_fault(const std::string& fault) {
  const std::lock_guard lock(health_mutex_);
  if (send_fault_.empty()) send_fault_ = fault;
}

void CanDevice::send_requested_safe_values() {
  if (!safe_state_requested_.exchange(false, std::memory_order_acq_rel)) return;
  arrivals_.end();
  faults_.end_all();
  if (playback_) playback_->cancel();
  update_injected_bus_off();
  load_.end();
  for (Sent& sent : sent_) {
    for (std::size_t output = 0; output < sent.output_signal.size(); ++output) {
      sent.values[sent.output_signal[output]] = safe_outputs_[sent.first_output + output];
    }
    sent.retry = false;
    send_message(sent);
  }
}

void CanDevice::publish_if_changed() {
  if (!samples_changed_) return;
  samples_changed_ = false;
  published_->draft().values = samples_;  // same size: no allocation
  published_->draft().arrivals = arrivals_.completed();
  published_->publish();
}

void CanDevice::lose_inputs() {
  for (std::size_t input = 0; input < samples_.size(); ++input) {
    samples_[input].value = inputs_[input].safe_value;
    samples_[input].fresh = false;
  }
  reset_counters();
  samples_changed_ = true;
}

void CanDevice::reset_counters() {
  for (Received& received : received_) {
    received.decoder.reset_counter();
    received.without_faults.reset_counter();
  }
}

void CanDevice::set_health(bool connected, const std::string& fault) {
  connected_.store(connected, std::memory_order_relaxed);
  const std::lock_guard lock(health_mutex_);
  fault_ = fault;
}

void CanDevice::wake() noexcept {
  const std::uint64_t one = 1;
  static_cast<void>(::write(wake_fd_, &one, sizeof one));
}

}  // namespace hil::io::can
