#include "io/can/message_coder.hpp"

#include <algorithm>

#include "io/can/assertion.hpp"
#include "io/can/checksum.hpp"
#include "io/can/signal_overlap.hpp"

namespace hil::io::can {

namespace {

std::optional<std::size_t> index_of(const DbcMessage& message, const std::string& signal_name) {
  const DbcSignal* const signal = signal_name.empty() ? nullptr : message.find_signal(signal_name);
  if (signal == nullptr) return std::nullopt;
  return static_cast<std::size_t>(signal - message.signals.data());
}

std::size_t frame_length_for(std::size_t message_length) {
  while (message_length < CANFD_MAX_DLEN && !valid_length(message_length, true))
    ++message_length;
  return message_length;
}

/// One frame can not carry both signals of an overlapping pair.
void add_overlaps(const DbcMessage& message, std::vector<std::string>& problems) {
  constexpr std::size_t max_named = 20;
  const auto pairs = overlapping_pairs(message, max_named + 1);
  if (pairs.empty()) return;
  std::string list;
  for (std::size_t index = 0; index < std::min(pairs.size(), max_named); ++index) {
    list.append(index == 0 ? "'" : ", '").append(message.signals[pairs[index].first].name).append("' and '");
    list.append(message.signals[pairs[index].second].name).append("'");
  }
  if (pairs.size() > max_named) list += " and more";
  problems.push_back("message '" + message.name + "' can not be sent: these of its signals overlap: " + list);
}

}  // namespace

std::vector<std::string> coding_problems(const DbcMessage& message, const Protection& protection, Use use) {
  std::vector<std::string> problems;
  const std::string of_message = " of message '" + message.name + "' ";
  for (const std::string& reason : message.unusable)
    problems.push_back("message '" + message.name + "' can not be used: " + reason);
  if (use == Use::send && message.unusable.empty()) add_overlaps(message, problems);
  const auto check = [&](const std::string& name, const char* role, std::uint16_t shortest,
                         std::uint16_t longest) {
    if (name.empty()) return;
    const DbcSignal* const signal = message.find_signal(name);
    if (signal == nullptr) {
      problems.push_back("message '" + message.name + "' has no signal '" + name + "' to be its " + role);
    } else if (signal->type != ValueType::unsigned_integer || signal->length_bits < shortest ||
               signal->length_bits > longest || signal->multiplexer >= 0 || signal->is_multiplexer) {
      problems.push_back("signal '" + name + "'" + of_message + "can not be its " + role +
                         ": that takes an unsigned, " + "not multiplexed integer of " +
                         (shortest == longest ? "" : std::to_string(shortest) + " to ") +
                         std::to_string(longest) + " bits");
    }
  };
  check(protection.counter_signal, "counter", 2, 32);
  check(protection.checksum_signal, "checksum", 8, 8);
  if (!protection.counter_signal.empty() && protection.counter_signal == protection.checksum_signal) {
    problems.push_back("signal '" + protection.counter_signal + "'" + of_message +
                       "can not be counter and checksum");
  }
  return problems;
}

MessageLayout::MessageLayout(const DbcMessage& message, const Protection& protection, Use use)
    : can_id_(message.id | (message.is_extended ? CAN_EFF_FLAG : 0U)),
      is_fd_(message.is_fd || message.length_bytes > CAN_MAX_DLEN),
      format_is_stated_(message.format_is_stated || message.length_bytes > CAN_MAX_DLEN),
      bit_rate_switch_(message.bit_rate_switch),
      length_(frame_length_for(message.length_bytes)),
      counter_(index_of(message, protection.counter_signal)),
      checksum_(index_of(message, protection.checksum_signal)) {
  require(coding_problems(message, protection, use).empty(), "a coded message has no coding problems");
  parts_.reserve(message.signals.size());
  for (const DbcSignal& signal : message.signals) {
    parts_.push_back({SignalCodec(signal), signal.multiplexer, signal.multiplex_ranges});
  }
}

std::uint8_t MessageLayout::checksum_of(std::span<const std::uint8_t> payload) const noexcept {
  return message_checksum(can_id_, payload, parts_[*checksum_].codec);
}

MessageEncoder::MessageEncoder(const DbcMessage& message, const Protection& protection)
    : layout_(message, protection, Use::send), raw_(message.signals.size(), 0) {}

Frame MessageEncoder::build(std::span<const double> values, Tally& tally) noexcept {
  require(values.size() == raw_.size(), "one value per signal of the message");
  for (std::size_t signal = 0; signal < raw_.size(); ++signal) {
    if (layout_.is_protection(signal)) continue;
    const SignalCodec::Encoded encoded = layout_.codec(signal).to_raw(values[signal]);
    if (encoded.verdict == SignalCodec::Verdict::refused) {
      ++tally.refused;
      continue;
    }
    if (encoded.verdict == SignalCodec::Verdict::saturated) ++tally.saturated;
    raw_[signal] = encoded.raw;
  }
  if (layout_.counter()) raw_[*layout_.counter()] = next_counter_;

  Frame frame;
  frame.raw.can_id = layout_.can_id();
  frame.raw.len = static_cast<std::uint8_t>(layout_.frame_length());
  frame.is_fd = layout_.is_fd();
  if (layout_.bit_rate_switch()) frame.raw.flags = CANFD_BRS;
  frame.direction = Direction::tx;
  const std::span<std::uint8_t> payload(frame.raw.data, frame.raw.len);
  const auto raw_of = [&](std::size_t signal) -> std::optional<std::uint64_t> { return raw_[signal]; };
  for (std::size_t signal = 0; signal < raw_.size(); ++signal) {
    if (layout_.is_present(signal, raw_of)) layout_.codec(signal).insert(payload, raw_[signal]);
  }
  if (layout_.checksum()) layout_.codec(*layout_.checksum()).insert(payload, layout_.checksum_of(payload));
  return frame;
}

std::uint64_t MessageEncoder::confirm_sent() noexcept {
  const std::uint64_t sent = next_counter_;
  if (layout_.counter()) next_counter_ = (next_counter_ + 1) & layout_.codec(*layout_.counter()).mask();
  return sent;
}

MessageDecoder::MessageDecoder(const DbcMessage& message, const Protection& protection)
    : layout_(message, protection, Use::receive) {}

MessageDecoder::Verdict MessageDecoder::check(const Frame& frame) noexcept {
  if (!layout_.is_of_right_kind(frame)) return Verdict::wrong_kind;
  // Bytes beyond the message are padding, which the checksum does not cover.
  const auto payload = frame.payload().first(std::min<std::size_t>(frame.raw.len, layout_.frame_length()));
  if (layout_.checksum()) {
    const SignalCodec& codec = layout_.codec(*layout_.checksum());
    if (!codec.is_whole_in(payload.size()) || codec.extract(payload) != layout_.checksum_of(payload)) {
      ++unknown_counters_;
      return Verdict::bad_checksum;
    }
  }
  if (layout_.counter()) {
    const SignalCodec& codec = layout_.codec(*layout_.counter());
    if (!codec.is_whole_in(payload.size())) {
      ++unknown_counters_;
      return Verdict::bad_counter;
    }
    const std::uint64_t counter = codec.extract(payload);
    const std::uint64_t steps = last_counter_ ? (counter - *last_counter_) & codec.mask() : 1;
    const bool is_first_again = steps == 0 && unknown_counters_ >= codec.mask();
    const bool expected = is_first_again || (steps >= 1 && steps <= 1 + unknown_counters_);
    last_counter_ = counter;
    unknown_counters_ = 0;
    if (!expected) return Verdict::bad_counter;
  }
  return Verdict::accepted;
}

}  // namespace hil::io::can
