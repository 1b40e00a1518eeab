#pragma once
// Faults of the frames of messages, between a device and its bus. Several faults of one message act in the
// order in which they were added.
//
// Threads: add before the start; set and count on any thread; the rest on the device's thread.

#include <atomic>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "io/can/can_counters.hpp"
#include "io/can/frame.hpp"
#include "io/can/frame_fault.hpp"
#include "io/can/message_coder.hpp"
#include "io/run_clock.hpp"

namespace hil::io::can {

class FrameFaults {
 public:
  // They add a fault, which is not active. The first one has number 0.
  /// Of the frames of a message. `layout`: of the message, which outlives this object.
  void add(std::unique_ptr<FrameFault> fault, const MessageLayout& layout);
  /// Of played frames that no message of the DBC file has.
  void add(std::unique_ptr<FrameFault> fault, canid_t identifier);
  /// Of the device.
  void add_bus_off();

  /// Whether a fault, active or not, is one of the frame's message.
  bool is_for(const Frame& frame) const noexcept { return by_id_.contains(frame.raw.can_id & id_mask); }
  void set(std::size_t number, bool active) noexcept {
    faults_[number]->active.store(active, std::memory_order_release);
  }
  /// The frames that came while it was active.
  std::uint64_t count(std::size_t number) const noexcept { return faults_[number]->count.get(); }
  /// Those of them that it dropped, or on which it acted and that left the faults of the message changed,
  /// repeated or delayed.
  std::uint64_t effects(std::size_t number) const noexcept { return faults_[number]->effects.get(); }
  /// The fault that let no frame through that this one would have changed; empty: there is none.
  std::optional<std::size_t> stopped_by(std::size_t number) const noexcept;

  /// Whether a fault is bus-off.
  bool is_bus_off(std::size_t number) const noexcept { return faults_[number]->is_bus_off(); }
  /// Whether the bus-off of a fault is active.
  bool is_bus_off() const noexcept;
  /// A frame of this identifier that bus-off blocks, in either direction.
  void note_blocked_frame(canid_t identifier) noexcept;

  /// For good, since nothing may keep safe values from the bus: drops the delayed frames, too, which is an
  /// effect of their delays.
  void end_all() noexcept;
  /// The frames that go on now in place of this one, most often itself; valid until the next call.
  std::span<const Frame> pass(const Frame& frame, RunTimeNs now_ns);
  /// The delayed frames that are due, stamped with their time; valid until the next call.
  std::span<const Frame> take_due(RunTimeNs now_ns);
  /// When the next delayed frame is due.
  std::optional<RunTimeNs> next_due_ns() const noexcept;

 private:
  static constexpr canid_t id_mask = CAN_EFF_FLAG | CAN_EFF_MASK;
  struct Fault {
    Fault(std::unique_ptr<FrameFault> of_frames, const MessageLayout* of_message, std::size_t its_number)
        : frames(std::move(of_frames)), layout(of_message), number(its_number) {}
    bool is_bus_off() const noexcept { return frames == nullptr; }
    const std::unique_ptr<FrameFault> frames;  ///< null: bus-off
    const MessageLayout* const layout;         ///< null: there is no description of its frames
    const std::size_t number;
    std::atomic<bool> active{false};
    Count count{}, effects{};
    std::uint64_t last_effect = 0;            ///< the number of the frame
    std::atomic<bool> left_unchanged{false};  ///< a frame that came to it left as it had come
    static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();
    std::atomic<std::size_t> stopped_by{none};  ///< the fault that dropped a frame on which this one acts
  };
  /// A frame on its way through the faults of its message.
  struct Passage {
    Frame first;               ///< as it came
    std::uint64_t number = 0;  ///< of the frames that came
    std::vector<Fault*> acted{};
  };
  struct Held {
    Frame frame;
    std::size_t next_fault;  ///< of its message: the one that acts after the delay
    Passage passage;
  };

  bool is_active(const Fault& fault) const noexcept {
    return !is_ended_ && fault.active.load(std::memory_order_acquire);
  }
  /// Of the passage_. `differs`: the frame is repeated or late.
  void pass_from(const std::vector<Fault*>& faults, std::size_t first, Frame frame, RunTimeNs now_ns,
                 bool differs);
  void note_dropped(const std::vector<Fault*>& faults, std::size_t by) noexcept;
  void note_passed(bool differs) noexcept;
  void add(std::unique_ptr<FrameFault> fault, const MessageLayout* layout, canid_t identifier);

  bool is_ended_ = false;
  std::vector<std::unique_ptr<Fault>> faults_;
  std::map<canid_t, std::vector<Fault*>> by_id_;
  std::multimap<RunTimeNs, Held> held_;
  std::vector<Frame> passed_;
  Passage passage_{};
  std::uint64_t frames_ = 0;  ///< of messages with faults
};

}  // namespace hil::io::can
