#pragma once
// Converts one message of the DBC file between values and frames, with its rolling counter and checksum.
//
// Counter: an unsigned integer signal of the message that grows by one with every frame sent and wraps at the
// end of its bits. Checksum: an 8-bit signal, see checksum.hpp. Both are written at the send instant.
//
// Threads: one thread. After construction nothing allocates.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/can/dbc.hpp"
#include "io/can/frame.hpp"
#include "io/can/signal_codec.hpp"

namespace hil::io::can {

/// Names of the protecting signals; empty: the message has none.
struct Protection {
  std::string counter_signal;
  std::string checksum_signal;
};

enum class Use : std::uint8_t {
  send,
  receive,  ///< overlapping signals can be read but not written
};

/// Every reason why the message can not be coded with this protection, one clause each; empty: it can.
std::vector<std::string> coding_problems(const DbcMessage& message, const Protection& protection, Use use);

/// The signals and protection of one message. Misuse (asserts): a message with coding_problems().
class MessageLayout {
 public:
  MessageLayout(const DbcMessage& message, const Protection& protection, Use use);

  struct Part {
    SignalCodec codec;
    int multiplexer = -1;
    std::vector<MultiplexRange> ranges;
  };

  canid_t can_id() const noexcept { return can_id_; }  ///< with CAN_EFF_FLAG for 29-bit identifiers
  bool is_fd() const noexcept { return is_fd_; }
  bool bit_rate_switch() const noexcept { return bit_rate_switch_; }
  /// False for a remote request, and for a frame of the other format (FD or classic).
  bool is_of_right_kind(const Frame& frame) const noexcept {
    return !frame.is_remote() && (!format_is_stated_ || frame.is_fd == is_fd_);
  }
  /// The length of a frame: the message's length, or the next one that CAN FD allows.
  std::size_t frame_length() const noexcept { return length_; }
  std::size_t signal_count() const noexcept { return parts_.size(); }
  const SignalCodec& codec(std::size_t signal) const noexcept { return parts_[signal].codec; }
  std::optional<std::size_t> counter() const noexcept { return counter_; }
  std::optional<std::size_t> checksum() const noexcept { return checksum_; }
  bool is_protection(std::size_t signal) const noexcept { return signal == counter_ || signal == checksum_; }
  std::uint8_t checksum_of(std::span<const std::uint8_t> payload) const noexcept;

  /// True when the signal's multiplexers select it. `raw_of(signal)` gives the raw value of a multiplexer, or
  /// an empty optional where it is not known: the signals that it selects are then not present.
  template <typename RawOf>
  bool is_present(std::size_t signal, const RawOf& raw_of) const noexcept {
    for (int at = static_cast<int>(signal); parts_[static_cast<std::size_t>(at)].multiplexer >= 0;) {
      const Part& part = parts_[static_cast<std::size_t>(at)];
      const std::optional<std::uint64_t> switch_value = raw_of(static_cast<std::size_t>(part.multiplexer));
      bool selected = false;
      for (const MultiplexRange& range : part.ranges) {
        selected = selected || (switch_value && *switch_value >= range.first && *switch_value <= range.last);
      }
      if (!selected) return false;
      at = part.multiplexer;
    }
    return true;
  }

 private:
  canid_t can_id_;
  bool is_fd_;
  bool format_is_stated_;
  bool bit_rate_switch_;
  std::size_t length_;
  std::vector<Part> parts_;
  std::optional<std::size_t> counter_;
  std::optional<std::size_t> checksum_;
};

/// Values -> frames.
class MessageEncoder {
 public:
  MessageEncoder(const DbcMessage& message, const Protection& protection);

  const MessageLayout& layout() const noexcept { return layout_; }

  struct Tally {
    std::uint32_t saturated = 0;  ///< values out of range
    std::uint32_t refused = 0;    ///< NaN: the signal kept its previous value
  };

  /// `values` has one physical value per signal of the message; those of counter and checksum are ignored.
  /// Uses the next counter value, which does not advance before confirm_sent().
  Frame build(std::span<const double> values, Tally& tally) noexcept;
  /// Confirms that the last built frame was sent. Returns its counter value.
  std::uint64_t confirm_sent() noexcept;

 private:
  MessageLayout layout_;
  std::vector<std::uint64_t> raw_;
  std::uint64_t next_counter_ = 0;
};

/// Frames -> values.
class MessageDecoder {
 public:
  MessageDecoder(const DbcMessage& message, const Protection& protection);

  const MessageLayout& layout() const noexcept { return layout_; }

  enum class Verdict : std::uint8_t {
    accepted,
    wrong_kind,    ///< a remote request, or a frame of the other format
    bad_checksum,  ///< or the frame is too short to carry the checksum
    bad_counter,   ///< or the frame is too short to carry the counter
  };

  /// Checks a frame with this message's identifier. It may be longer than the message (padding) or shorter.
  /// The first counter value is always accepted. A wrong counter value becomes the reference for the next
  /// one, so a lost frame causes one rejected frame, not all that follow. Of a frame that is rejected for its
  /// checksum or its length the counter is not known: for each of them the next counter may be one higher.
  Verdict check(const Frame& frame) noexcept;

  /// Calls `take(signal index, physical value)` for each signal that is present and completely contained.
  /// Those of a rejected frame are not to be trusted.
  template <typename Take>
  void decode(const Frame& frame, const Take& take) const noexcept {
    const auto payload = frame.payload();
    const auto raw_of = [&](std::size_t signal) -> std::optional<std::uint64_t> {
      const SignalCodec& codec = layout_.codec(signal);
      if (!codec.is_whole_in(payload.size())) return std::nullopt;
      return codec.extract(payload);
    };
    for (std::size_t signal = 0; signal < layout_.signal_count(); ++signal) {
      const SignalCodec& codec = layout_.codec(signal);
      if (codec.is_whole_in(payload.size()) && layout_.is_present(signal, raw_of))
        take(signal, codec.decode(payload));
    }
  }

  /// A frame came whose counter is not known, as one that is rejected for its checksum.
  void note_unknown_counter() noexcept { ++unknown_counters_; }

  /// Accepts any next counter value, after the sender was lost.
  void reset_counter() noexcept {
    last_counter_.reset();
    unknown_counters_ = 0;
  }

 private:
  MessageLayout layout_;
  std::optional<std::uint64_t> last_counter_;
  std::uint64_t unknown_counters_ =
      0;  ///< frames since the one with last_counter_ whose counter is not known
};

}  // namespace hil::io::can
