#include "runtime/recording/recorder.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>

#include <hil/require.hpp>

#include "io/device.hpp"
#include "runtime/executive/spsc_ring.hpp"
#include "runtime/recording/message_text.hpp"

namespace hil::recording {
namespace {

constexpr std::size_t ring_words = std::size_t{1} << 21;  // 16 MiB of values
constexpr std::size_t messages_of_largest = 4;            // at least so many of the largest topic fit
constexpr std::size_t ring_frames = 16'384;
constexpr std::uint64_t bytes_for_end = 4096;   // of the metadata at the end
constexpr std::uint64_t share_for_events = 16;  // one part in so many of the file
constexpr std::chrono::milliseconds pause{10};
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

}  // namespace

struct Recorder::Topic {
  struct Member {
    std::uint32_t signal = 0;
    bool fresh = false;
    std::int64_t time_ns = std::numeric_limits<std::int64_t>::min();  ///< of the last write
    std::string key;                                                  ///< `{"speed":` or `,"speed":`
  };
  std::uint16_t channel = 0;
  std::vector<Member> members;

  /// Whether a member was written since the last call.
  bool take_change(std::span<const signals::SignalValue> values) noexcept {
    bool is_changed = false;
    for (Member& member : members) {
      const signals::SignalValue& value = values[member.signal];
      if (value.time_ns == member.time_ns && value.fresh == member.fresh) continue;
      member.time_ns = value.time_ns;
      member.fresh = value.fresh;
      is_changed = true;
    }
    return is_changed;
  }
};

class Recorder::FrameRing final : public io::FrameSink {
 public:
  struct Frame {
    io::RunTimeNs time_ns = 0;
    std::size_t size = 0;
    std::array<std::byte, io::max_frame_bytes> bytes{};  ///< the first `size`
  };

  FrameRing(Recorder& recorder, const RecordedBus& bus, std::uint16_t channel)
      : recorder_(recorder), bus_(bus), channel_(channel), ring_(ring_frames) {}

  void take(io::RunTimeNs time_ns, std::span<const std::byte> frame) noexcept override {
    if (recorder_.options_.virtual_clock && ring_.half_full()) recorder_.drain();
    Frame copy{.time_ns = time_ns, .size = frame.size()};
    std::ranges::copy(frame, copy.bytes.begin());
    ring_.push(copy);
  }
  const std::string& bus() const noexcept { return bus_.name; }
  std::uint16_t channel() const noexcept { return channel_; }
  executive::SpscRing<Frame>& ring() noexcept { return ring_; }
  std::string text_of(const Frame& frame) const {
    return bus_.format.to_json(std::span(frame.bytes).first(frame.size));
  }

 private:
  Recorder& recorder_;
  const RecordedBus& bus_;
  const std::uint16_t channel_;
  executive::SpscRing<Frame> ring_;
};

Recorder::Recorder(RecorderOptions options, const signals::SignalTable& table,
                   std::span<const signals::SignalId> signals)
    : options_(std::move(options)),
      event_limit_(options_.max_bytes - bytes_for_end),
      tick_limit_(options_.max_bytes - options_.max_bytes / share_for_events),
      writer_(options_.file, options_.max_bytes) {
  config::require(options_.max_bytes >= min_bytes, "a recording may have at least 1 MiB");
  if (!writer_.add_metadata("run", options_.about_run)) refuse();
  events_ = added(event_topic());
  misses_ = added(miss_topic());
  for (const RecordedBus& bus : options_.frame_buses)
    frames_.push_back(std::make_unique<FrameRing>(*this, bus, added(frame_topic(bus.name, bus.format))));
  std::size_t largest = 0;
  for (const SignalTopic& described : signal_topics(table, signals)) {
    Topic& topic = topics_.emplace_back();
    topic.channel = added(described.topic);
    for (const SignalTopic::Member& member : described.members) {
      const char* const before = topic.members.empty() ? "{" : ",";
      topic.members.emplace_back();
      topic.members.back().signal = member.signal.index;
      topic.members.back().key = std::string(before).append(json_text(member.name)).append(":");
    }
    largest = std::max(largest, topic.members.size() + 2);
  }
  values_ = std::make_unique<ValueRing>(std::max(ring_words, messages_of_largest * largest));
  if (!options_.virtual_clock) thread_ = std::thread([this] { serve(); });
}

Recorder::~Recorder() {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
}

void Recorder::refuse() const {
  throw io::DeviceError(
      "the descriptions of the topics of " + options_.file.string() +
      " do not fit into 'max_size' of the recording; choose a larger size or fewer signals");
}

std::uint16_t Recorder::added(const McapTopic& topic) {
  std::uint16_t channel = 0;
  if (!writer_.add_topic(topic, channel)) refuse();
  return channel;
}

io::FrameSink* Recorder::frame_sink(const std::string& bus) noexcept {
  const auto found = std::ranges::find(frames_, bus, [](const auto& ring) { return ring->bus(); });
  return found == frames_.end() ? nullptr : found->get();
}

void Recorder::take(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  const std::span<const signals::SignalValue> values = table.values();
  for (std::uint32_t i = 0; i < topics_.size(); ++i) {
    Topic& topic = topics_[i];
    if (!topic.take_change(values)) continue;
    const auto value = [&](std::size_t member) {
      const std::uint32_t signal = topic.members[member].signal;
      return table.is_readable({signal}) ? values[signal].value : unknown;
    };
    if (values_->push(time_ns, i, topic.members.size(), value)) continue;
    if (options_.virtual_clock) {
      drain();
      values_->push(time_ns, i, topic.members.size(), value);
    } else {
      dropped_.fetch_add(1, std::memory_order_relaxed);
    }
  }
}

void Recorder::serve() {
  while (!stopping_.load(std::memory_order_acquire)) {
    drain();
    std::this_thread::sleep_for(pause);
  }
}

/// Writes what the rings hold, the oldest first.
void Recorder::drain() {
  for (;;) {
    FrameRing* earliest = nullptr;
    std::int64_t time_ns = std::numeric_limits<std::int64_t>::max();
    for (const auto& ring : frames_) {
      const FrameRing::Frame* const frame = ring->ring().front();
      if (frame == nullptr || (earliest != nullptr && frame->time_ns >= time_ns)) continue;
      earliest = ring.get();
      time_ns = frame->time_ns;
    }
    if (!values_->is_empty() && (earliest == nullptr || values_->time_ns() <= time_ns)) {
      write_values();
    } else if (earliest != nullptr) {
      write(earliest->channel(), time_ns, earliest->text_of(*earliest->ring().front()), tick_limit_);
      earliest->ring().pop();
    } else {
      return;
    }
  }
}

void Recorder::write_values() {
  const Topic& topic = topics_[values_->topic()];
  text_.clear();
  for (std::size_t i = 0; i < topic.members.size(); ++i) {
    text_ += topic.members[i].key;
    append_number(text_, values_->value(i));
  }
  text_ += '}';
  write(topic.channel, values_->time_ns(), text_, tick_limit_);
  values_->pop();
}

void Recorder::write(std::uint16_t channel, std::int64_t time_ns, std::string_view text,
                     std::uint64_t limit) {
  time_ns = std::max<std::int64_t>(time_ns, 0);
  const bool is_late = limit == event_limit_;
  if ((is_late || !stopped_at_ns_) && writer_.write(channel, time_ns, text, limit)) return;
  ++not_recorded_;
  if (!stopped_at_ns_) stopped_at_ns_ = time_ns;
}

RecordingResult Recorder::close(std::span<const RecordedEvent> events, std::span<const RecordedMiss> misses) {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  drain();
  std::vector<Late> late;
  for (const RecordedEvent& event : events) {
    const std::int64_t time_ns = std::max<std::int64_t>(event.time_ns, 0);
    late.push_back({time_ns, events_, event_message(time_ns, event.text)});
  }
  for (const RecordedMiss& miss : misses)
    late.push_back({miss.time_ns, misses_, miss_message(miss.task, miss.tick, miss.cause, miss.lateness_ns)});
  std::ranges::stable_sort(late, {}, &Late::time_ns);
  for (const Late& message : late)
    write(message.channel, message.time_ns, message.text, event_limit_);

  RecordingResult result{.messages = writer_.messages(),
                         .dropped = dropped_.load(std::memory_order_relaxed),
                         .stopped_at_ns = stopped_at_ns_,
                         .not_recorded = not_recorded_,
                         .fault = {}};
  for (const auto& ring : frames_)
    result.dropped += ring->ring().lost();
  McapMetadata end{{"dropped", std::to_string(result.dropped)},
                   {"not_recorded", std::to_string(result.not_recorded)}};
  if (stopped_at_ns_) end.emplace_back("stopped_at_s", seconds(*stopped_at_ns_));
  writer_.add_metadata("recording", end);
  result.fault = writer_.close();
  result.bytes = writer_.bytes();
  return result;
}

}  // namespace hil::recording
